"""Columns of the history of a run: a line here and the line of a kernel that fills it make a new one."""

from enum import IntEnum
from typing import Self


class History(IntEnum):
    """Columns of `State.now` and of the recorded history: unit and meaning. Downward velocities are negative: x3 points up."""

    unit: str
    meaning: str

    def __new__(cls, unit: str, meaning: str) -> Self:
        number = len(cls.__members__)
        column = int.__new__(cls, number)
        column._value_, column.unit, column.meaning = number, unit, meaning
        return column

    TIME = "s", "of the row"
    TIME_STEP = "s", "from this row to the next"
    HEIGHT = "m", "of the upper cover above the ground"
    VELOCITY = "m/s", "of the cargo"
    ACCELERATION = "m/s^2", "of the cargo"
    PRESSURE = "Pa", "p~(t), gauge; of a table the mean from the half-step before to that after the row's time"
    COVER_FORCE = "N", "on the cargo from gas and fabric, up positive, without weight"
    GROUND_FORCE = "N", "on the ground from gas, lower cover and fabric, down positive"
    TENSION_GENERATRIX = "N/m", "largest T11 of the step"
    TENSION_HOOP = "N/m", "largest T22 of the step"
    TENSION_BELT = "N/m", "largest N22 of the step"
    KINETIC_ENERGY = "J", "of cargo and shell, at the half-step before the row's time"
    WORK_PRESSURE = "J", "since the start, as all works: up to the half-step before the row's time"
    WORK_ELASTIC = "J", "done by the fabric's elastic tensions and shear on the nodes"
    WORK_VISCOUS = "J", "done by the fabric's and belts' viscous tensions"
    WORK_BELTS = "J", "done by the belts' elastic tensions"
    WORK_GRAVITY = "J", "done by gravity on cargo and shell"
    WORK_GROUND = "J", "lost where fabric is stopped by the ground"
    WORK_CONTACT = "J", "lost in contact, and in friction on the ground"
    CONTACT_FORCE = "N", "of the fabric on cover and cargo, up positive; part of the cover force"
    GROUND_AREA = "m^2", "of fabric and lower cover on the ground"
    TEMPERATURE = "K", "of the gas; as all that follows of a gas with a state alone"
    GAS_MASS = "kg", "in the shell"
    VOLUME = "m^3", "of the shell"
    VENT_FLOW = "kg/s", "through vents and wall, outwards positive"
    GAS_ENERGY = "J", "internal energy of the gas"
    GAS_WORK = "J", "done by the gas, against the ambient pressure too, since the start"
    ENTHALPY_OUT = "J", "of what has left the gas since the start"
    ENTHALPY_IN = "J", "of what has come in"
    HEAT = "J", "taken from the surroundings since the start, of a process that is not adiabatic"


WORKS = tuple(column for column in History if column.name.startswith("WORK_"))  # all of the ledger
OF_GAS = tuple(History)[History.TEMPERATURE : History.HEAT + 1]  # of a gas with a state, 0 without one
