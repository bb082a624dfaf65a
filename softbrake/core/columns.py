"""Columns of the history of a run."""

from enum import IntEnum


class History(IntEnum):
    """Columns of `State.now` and of the recorded history. Downward velocities are negative here: x3 points up."""

    TIME = 0  # s
    TIME_STEP = 1  # s, from this row to the next
    HEIGHT = 2  # m, of the upper cover above the ground
    VELOCITY = 3  # m/s, of the cargo
    ACCELERATION = 4  # m/s^2, of the cargo
    PRESSURE = 5  # Pa, p~(t)
    COVER_FORCE = 6  # N, on the cargo from gas and fabric, up positive, without weight
    GROUND_FORCE = 7  # N, on the ground from gas, lower cover and fabric, down positive
    TENSION_GENERATRIX = 8  # N/m, largest T11 of the step
    TENSION_HOOP = 9  # N/m, largest T22 of the step
    TENSION_BELT = 10  # N/m, largest N22 of the step
    KINETIC_ENERGY = 11  # J, of cargo and shell, at the half-step before the row's time
    WORK_PRESSURE = 12  # J, since the start, as all works: up to the half-step before the row's time
    WORK_ELASTIC = 13  # J, done by the fabric's elastic tensions and shear on the nodes
    WORK_VISCOUS = 14  # J, done by the fabric's and belts' viscous tensions
    WORK_BELTS = 15  # J, done by the belts' elastic tensions
    WORK_GRAVITY = 16  # J
    WORK_GROUND = 17  # J, lost where fabric is stopped by the ground
    WORK_CONTACT = 18  # J, lost in contact, and in friction on the ground
    CONTACT_FORCE = 19  # N, of the fabric on cover and cargo, up positive; part of the cover force
    GROUND_AREA = 20  # m^2, of fabric and lower cover on the ground


UNITS = {
    History.TIME: "s",
    History.TIME_STEP: "s",
    History.HEIGHT: "m",
    History.VELOCITY: "m/s",
    History.ACCELERATION: "m/s^2",
    History.PRESSURE: "Pa",
    History.COVER_FORCE: "N",
    History.GROUND_FORCE: "N",
    History.TENSION_GENERATRIX: "N/m",
    History.TENSION_HOOP: "N/m",
    History.TENSION_BELT: "N/m",
    History.KINETIC_ENERGY: "J",
    History.WORK_PRESSURE: "J",
    History.WORK_ELASTIC: "J",
    History.WORK_VISCOUS: "J",
    History.WORK_BELTS: "J",
    History.WORK_GRAVITY: "J",
    History.WORK_GROUND: "J",
    History.WORK_CONTACT: "J",
    History.CONTACT_FORCE: "N",
    History.GROUND_AREA: "m^2",
}
