"""The gas in the shell: mass and entropy, uniform in space, between two volumes of the shell; vents, leaking wall, inflator.

State: the mass m, and for the entropy the free volume F that the gas would take at ambient pressure along its process. So
P = Pa (F/V)^n with n = gamma of an adiabatic bag, exactly, whatever way the volume took; what flows out leaves F/m as it is.
Where F < V the wall is limp: it holds no suction, the gas has ambient pressure and the volume F.

A step goes from V0 to V1: half of what flows in and out at V0, the change of volume, the other half at V1. Each part is exact, so
the first law closes to round-off; their order is of second order in the step. Outflow takes the enthalpy cp T of the inside, by
the isentropic nozzle, choked or not. It ends where the pressures are equal.
Sources: Moran and Shapiro, Fundamentals of Engineering Thermodynamics, ch. 4, 9 (control volume, nozzle); Wang and Nefske,
SAE 880654 (uniform bag).
"""

from math import inf, log, sqrt

from numba import uint64

from softbrake.core.arrays import GasState, Peak, VentConstant, VentState
from softbrake.core.columns import History
from softbrake.core.jit import kernel
from softbrake.core.lanes import ONE
from softbrake.core.peaks import raise_peak
from softbrake.core.tables import integral_of_table

LEAST_VOLUME = 1e-5  # of that at first contact
PART_OF_VOLUME = 0.05  # by which it may fall in a step of Courant coefficient 1
MOST_CHANGE = 0.02  # of the volume, at once, where some flows in or out
MOST_FLOW_RATIO = 0.1  # of that to the part that could flow out: 0.2 of it at once
TABLE = len(VentConstant)  # column of `Gas.vents` where the table of a discharge begins
NEAR_ONE = 1e-3  # distance within which five terms of the series are exact to round-off


@kernel
def pressure_after(gas, pressure, before, after):
    """Return the absolute pressure (Pa) of a gas whose free volume over its volume goes from one ratio to another."""
    if after <= 1.0:
        return gas.ambient_pressure
    if before <= 1.0:
        return gas.ambient_pressure * after**gas.exponent
    return pressure * power_near_one(after / before, gas.exponent)


@kernel
def power_near_one(base, exponent):
    """Return a power, to the last digits: near 1 by the binomial series, a third of the time."""
    x = base - 1.0
    if abs(x) > NEAR_ONE:
        return base**exponent
    cubic = 1.0 + (exponent - 2.0) * x * (1.0 / 3.0) * (1.0 + (exponent - 3.0) * x * 0.25 * (1.0 + (exponent - 4.0) * x * 0.2))
    return 1.0 + exponent * x * (1.0 + (exponent - 1.0) * x * 0.5 * cubic)


@kernel
def begin_gas(model, state, pressure, temperature, volume):
    """Fill a volume (m^3) with gas of a gauge pressure (Pa) and a temperature (K): less than full below 0. Writes state, now."""
    gas, chamber, vents = model.gas, state.gas, state.vents
    ratio = 1.0 + pressure / gas.ambient_pressure
    chamber[GasState.TIME] = state.now[History.TIME]
    chamber[GasState.HEIGHT] = state.now[History.HEIGHT]
    chamber[GasState.VOLUME] = chamber[GasState.NEXT_VOLUME] = volume
    chamber[GasState.LEAST_VOLUME] = LEAST_VOLUME * volume
    chamber[GasState.MASS] = ratio * gas.ambient_pressure * volume / (gas.gas_constant * temperature)
    chamber[GasState.FREE_VOLUME] = volume * (ratio ** (1.0 / gas.exponent) if ratio > 1.0 else ratio)
    chamber[GasState.PRESSURE] = gas.ambient_pressure + max(pressure, 0.0)
    for k in range(vents.shape[0]):
        opened = gas.vents[k, VentConstant.OPENS_AT_TIME] == -inf
        vents[k, VentState.OPEN] = vents[k, VentState.SHARE] = 1.0 if opened else 0.0
        vents[k, VentState.OPENED_AT] = 0.0 if opened else inf
        vents[k, VentState.SHUT] = 0.0
    record_gas(gas, chamber, vents, state.now, state.peaks)


@kernel
def advance_gas(gas, chamber, vents, now, peaks):
    """Advance the gas to the time of now, the shell to its next volume. Writes chamber (State.gas), vents; peaks; now."""
    length = now[History.TIME] - chamber[GasState.TIME]
    if length <= 0.0:
        return
    volume = max(chamber[GasState.NEXT_VOLUME], chamber[GasState.LEAST_VOLUME])
    if gas.closed == 1:
        change_volume(gas, chamber, now, volume)
    else:
        rest, part = 1.0, 0.0
        while part < 1.0:
            part = part_of_step(gas, chamber, rest * length, volume)
            height = chamber[GasState.HEIGHT] + part * (now[History.HEIGHT] - chamber[GasState.HEIGHT])
            between = chamber[GasState.VOLUME] + part * (volume - chamber[GasState.VOLUME])
            exchange(gas, chamber, vents, now, peaks, part * rest * length, height, between)
            rest *= 1.0 - part
    chamber[GasState.TIME] = now[History.TIME]
    chamber[GasState.HEIGHT] = now[History.HEIGHT]
    record_gas(gas, chamber, vents, now, peaks)


@kernel
def record_gas(gas, chamber, vents, now, peaks):
    """Write pressure (gauge), temperature and what else the history has of the gas to now, and raise the peaks."""
    pressure, volume, mass = chamber[GasState.PRESSURE], chamber[GasState.VOLUME], chamber[GasState.MASS]
    filled = min(volume, chamber[GasState.FREE_VOLUME])
    now[History.PRESSURE] = pressure - gas.ambient_pressure
    now[History.TEMPERATURE] = pressure * filled / (mass * gas.gas_constant)
    now[History.GAS_MASS] = mass
    now[History.VOLUME] = volume
    now[History.GAS_ENERGY] = pressure * filled / (gas.gamma - 1.0)
    now[History.VENT_FLOW] = 0.0
    if gas.closed == 0:
        now[History.VENT_FLOW] = outflow(gas, chamber, vents, mass, chamber[GasState.FREE_VOLUME], volume) - inflow(
            gas, chamber, vents
        )
    raise_peak(peaks, Peak.PRESSURE, now[History.PRESSURE], now[History.TIME], 0.0)
    raise_peak(peaks, Peak.TEMPERATURE, now[History.TEMPERATURE], now[History.TIME], 0.0)


@kernel
def change_volume(gas, chamber, now, volume):
    """Take the gas to another volume (m^3), its mass kept. Writes chamber; work and heat to now."""
    free, old = chamber[GasState.FREE_VOLUME], min(chamber[GasState.VOLUME], chamber[GasState.FREE_VOLUME])
    before, new = chamber[GasState.PRESSURE], min(volume, free)
    after = pressure_after(gas, before, free / chamber[GasState.VOLUME], free / volume)
    isothermal, excess = gas.exponent == 1.0, gas.exponent - 1.0
    work = before * old * log(new / old) if isothermal else (before * old - after * new) / excess
    now[History.GAS_WORK] += work
    if gas.exponent != gas.gamma:
        now[History.HEAT] += work + (after * new - before * old) / (gas.gamma - 1.0)
    chamber[GasState.VOLUME] = volume
    chamber[GasState.PRESSURE] = after


@kernel
def part_of_step(gas, chamber, length, volume):
    """Return the part of a time (s) that the gas takes at once: a little of its volume, on its way to another one (m^3).

    Where the last of the gas is pressed out, its volume and what flows of it change by more in a step of the cargo.
    """
    part = MOST_CHANGE / max(abs(volume / chamber[GasState.VOLUME] - 1.0), MOST_FLOW_RATIO * venting_rate(gas, chamber) * length)
    return min(part, 1.0)


@kernel
def exchange(gas, chamber, vents, now, peaks, length, height, volume):
    """Take the gas to another volume (m^3) while some flows in and out for a time (s). Writes chamber, vents, peaks; now.

    height: of the cover (m) then.
    """
    start, open_in = chamber[GasState.TIME], gas.inflow.shape[1] > 0
    end = start + length
    middle = 0.5 * (start + end)
    if open_in:
        fill(gas, chamber, now, integral_of_table(gas.inflow[0], gas.inflow[1], start, middle), gas.inflow_temperature)
    free, mass, old = chamber[GasState.FREE_VOLUME], chamber[GasState.MASS], chamber[GasState.VOLUME]
    left = mass_left(gas, chamber, vents, length, volume)
    reached = pressure_after(gas, chamber[GasState.PRESSURE], free / old, free * (left / mass) / volume)
    if switch_vents(gas, chamber, vents, peaks, length, height, reached):
        left = mass_left(gas, chamber, vents, length, volume)
    half = 0.5 * (mass + left)
    at_half, at_end = free * (half / mass), free * (left / mass)
    pressure = release(gas, now, chamber[GasState.PRESSURE], free, at_half, old)
    chamber[GasState.VENTED] += mass - left
    chamber[GasState.MASS], chamber[GasState.PRESSURE], chamber[GasState.FREE_VOLUME] = left, pressure, at_half
    change_volume(gas, chamber, now, volume)
    chamber[GasState.PRESSURE] = release(gas, now, chamber[GasState.PRESSURE], at_half, at_end, volume)
    chamber[GasState.FREE_VOLUME] = at_end
    draw_in(gas, chamber, vents, now, length)
    if open_in:
        fill(gas, chamber, now, integral_of_table(gas.inflow[0], gas.inflow[1], middle, end), gas.inflow_temperature)
    for k in range(vents.shape[0]):
        vents[k, VentState.SHARE] = vents[k, VentState.OPEN]
    chamber[GasState.TIME], chamber[GasState.HEIGHT] = end, height


@kernel
def release(gas, now, pressure, free, rest, volume):
    """Let gas out of a volume (m^3) until the rest of its free volume is left. Returns the pressure (Pa) then.

    At constant volume what the internal energy loses is the enthalpy that leaves, to the last digit; a limp wall follows at
    ambient pressure. Writes enthalpy, and the work of a limp wall, to now.
    """
    after = pressure_after(gas, pressure, free / volume, rest / volume)
    filled, left = min(free, volume), min(rest, volume)
    limp = gas.ambient_pressure * (filled - left)
    now[History.ENTHALPY_OUT] += (pressure * filled - after * left) / (gas.gamma - 1.0) + limp
    now[History.GAS_WORK] -= limp
    return after


@kernel
def fill(gas, chamber, now, mass, temperature):
    """Add mass (kg) of a temperature (K) at constant volume; a limp wall moves out at ambient pressure. Writes chamber; now."""
    if mass <= 0.0:
        return
    enthalpy = gas.gamma / (gas.gamma - 1.0) * gas.gas_constant * temperature * mass
    volume, free = chamber[GasState.VOLUME], chamber[GasState.FREE_VOLUME]
    taken = enthalpy * (gas.gamma - 1.0) / (gas.gamma * gas.ambient_pressure)  # m^3, at ambient pressure
    limp = min(max(volume - free, 0.0), taken)
    chamber[GasState.MASS] += mass
    chamber[GasState.FILLED] += mass
    chamber[GasState.FREE_VOLUME] = free + limp
    if limp < taken:
        rest = enthalpy - limp * gas.gamma / (gas.gamma - 1.0) * gas.ambient_pressure
        chamber[GasState.PRESSURE] += (gas.gamma - 1.0) * rest / volume
        chamber[GasState.FREE_VOLUME] = volume * (chamber[GasState.PRESSURE] / gas.ambient_pressure) ** (1.0 / gas.exponent)
    now[History.ENTHALPY_IN] += enthalpy
    now[History.GAS_WORK] += gas.ambient_pressure * limp


@kernel
def draw_in(gas, chamber, vents, now, length):
    """Let ambient gas into a limp shell. Writes chamber; now."""
    mass = length * inflow(gas, chamber, vents)
    if mass > 0.0:
        missing = (chamber[GasState.VOLUME] - chamber[GasState.FREE_VOLUME]) * ambient_density(gas)
        fill(gas, chamber, now, min(mass, missing), gas.ambient_temperature)


@kernel
def ambient_density(gas):
    """Return the density of the ambient gas (kg/m^3)."""
    return gas.ambient_pressure / (gas.gas_constant * gas.ambient_temperature)


@kernel
def inflow(gas, chamber, vents):
    """Return what flows into a limp shell (kg/s) through vents, as into one that holds its volume by itself."""
    volume, free, area = chamber[GasState.VOLUME], chamber[GasState.FREE_VOLUME], 0.0
    if free >= volume:
        return 0.0
    ratio = (free / volume) ** gas.exponent  # inside over ambient pressure, if the wall were stiff
    for k in range(vents.shape[0]):
        if gas.vents[k, VentConstant.INFLOW] > 0.0:
            area += vents[k, VentState.SHARE] * gas.vents[k, VentConstant.AREA] * coefficient(gas, k, ratio)
    return area * nozzle(gas, gas.ambient_pressure, ambient_density(gas), ratio, free / volume)


@kernel
def mass_left(gas, chamber, vents, length, volume):
    """Return the mass (kg) that is left after a time (s), while the volume goes on to another one (m^3): midpoint rule."""
    mass, free, old = chamber[GasState.MASS], chamber[GasState.FREE_VOLUME], chamber[GasState.VOLUME]
    between = 0.5 * (old + volume)
    half = mass - 0.5 * length * outflow(gas, chamber, vents, mass, free, old)
    half = min(max(half, mass * (between / free)), mass)  # not below ambient pressure
    left = mass - length * outflow(gas, chamber, vents, half, free * (half / mass), between)
    return min(max(left, mass * (volume / free)), mass)


@kernel
def outflow(gas, chamber, vents, mass, free, volume):
    """Return what flows out (kg/s) through vents, as far as they are open in the step, and wall. Reads chamber's free area."""
    if free <= volume:
        return 0.0
    root = volume / free  # of the pressures' ratio: the density outside over that inside
    before = chamber[GasState.FREE_VOLUME] / chamber[GasState.VOLUME]
    pressure, thick = pressure_after(gas, chamber[GasState.PRESSURE], before, free / volume), mass / volume
    ratio, area = gas.ambient_pressure / pressure, gas.leakage * chamber[GasState.FREE_AREA]
    for k in range(vents.shape[0]):
        if vents[k, VentState.SHARE] > 0.0:
            area += vents[k, VentState.SHARE] * gas.vents[k, VentConstant.AREA] * coefficient(gas, k, ratio)
    through = thick * face_velocity(gas, pressure - gas.ambient_pressure) * chamber[GasState.FREE_AREA]
    return through + area * nozzle(gas, pressure, thick, ratio, root)


@kernel
def nozzle(gas, pressure, density, ratio, root):
    """Return the mass flux (kg/(m^2 s)) of an isentropic nozzle from a pressure (Pa) and density (kg/m^3) upstream.

    ratio: of the pressure downstream to that; root: that of the densities, ratio^(1/gamma). Choked at and below gas.choking.
    """
    if ratio < gas.choking:
        ratio, root = gas.choking, gas.choked_root
    return sqrt(max(2.0 * gas.gamma / (gas.gamma - 1.0) * pressure * density * root * (root - ratio), 0.0))


@kernel
def coefficient(gas, k, ratio):
    """Return the discharge coefficient of vent k at a ratio of pressures, outside over inside."""
    vents, first = gas.vents, TABLE
    count = (vents.shape[1] - first) // 2
    if ratio <= vents[k, first]:
        return vents[k, first + count]
    for p in range(first + 1, first + count):
        if ratio < vents[k, p]:
            share = (ratio - vents[k, p - 1]) / (vents[k, p] - vents[k, p - 1])
            return vents[k, p + count - 1] + share * (vents[k, p + count] - vents[k, p + count - 1])
    return vents[k, first + 2 * count - 1]


@kernel
def face_velocity(gas, pressure):
    """Return the velocity (m/s) through the wall at a pressure difference (Pa): a measured parabola, or Ergun's law."""
    if gas.viscous + gas.inertial > 0.0:
        return 2.0 * pressure / (gas.viscous + sqrt(gas.viscous * gas.viscous + 4.0 * gas.inertial * pressure))
    if gas.quadratic < 0.0:
        pressure = min(pressure, -0.5 * gas.linear / gas.quadratic)  # a wall lets no less through at a higher pressure
    return pressure * (gas.linear + gas.quadratic * pressure)


@kernel
def switch_vents(gas, chamber, vents, peaks, length, height, reached):
    """Open and close vents within a time (s), at whose end height (m) and pressure (Pa, absolute) are reached.

    Pressure and height are straight lines over the step. Of those that have closed only one that pressure opens and closes, a
    relief valve, opens again. Writes vents, peaks. Returns whether some vent switched.
    """
    start, switched = chamber[GasState.TIME], False
    before, after = chamber[GasState.PRESSURE] - gas.ambient_pressure, reached - gas.ambient_pressure
    high, low = chamber[GasState.HEIGHT], height
    for k in range(vents.shape[0]):
        vent = gas.vents[k]
        if vents[k, VentState.SHUT] > 0.0:
            continue
        shuts = falls_to(high, low, vent[VentConstant.CLOSES_AT_HEIGHT])
        if vents[k, VentState.OPEN] > 0.0:
            level = vent[VentConstant.CLOSES_AT_PRESSURE]
            been_above = before > level or vent[VentConstant.OPENS_AT_PRESSURE] < inf  # when it opened, maybe within one step
            closes = falls_to(before, after, level) if been_above else inf
            if min(shuts, closes) <= 1.0:
                switched = True
                vents[k, VentState.OPEN], vents[k, VentState.SHARE] = 0.0, min(shuts, closes)
                again = shuts > 1.0 and vent[VentConstant.OPENS_AT_PRESSURE] < inf
                vents[k, VentState.SHUT] = 0.0 if again else 1.0
            continue
        if shuts <= 1.0:
            vents[k, VentState.SHUT] = 1.0  # before it opened
            continue
        burst = falls_to(-before, -after, -vent[VentConstant.OPENS_AT_PRESSURE])
        timed = max((vent[VentConstant.OPENS_AT_TIME] - start) / length, 0.0)
        at = min(burst, timed, falls_to(high, low, vent[VentConstant.OPENS_AT_HEIGHT]))
        if at <= 1.0:
            switched = True
            vents[k, VentState.OPEN], vents[k, VentState.SHARE] = 1.0, 1.0 - at
            vents[k, VentState.OPENED_AT] = min(vents[k, VentState.OPENED_AT], start + at * length)
            if at == burst:
                raise_peak(peaks, Peak.PRESSURE, vent[VentConstant.OPENS_AT_PRESSURE], start + at * length, 0.0)
    return switched


@kernel
def falls_to(before, after, level):
    """Return at which part of a step a value falls to a level, 0 where it is there already; infinite where it does not."""
    if before <= level:
        return 0.0
    return (before - level) / (before - after) if after <= level else inf


@kernel
def limit_with_gas(model, state, by_row, limit):
    """Return the stable step (s) of shell and gas, by that of the shell alone: see core.loop.step_size.

    Compression is one mode more, w² = n P Σ(a²/m)/V over all nodes and the cover, a of each no more than the product of its
    longest edges. A rate of 2/dt that holds both is the root of rate² = rate·(2/limit) + w². So is what a higher pressure than
    that of `limit` turns with the cloth: see pressure_bound. Venting adds its own rate.
    """
    if model.gas.exponent == 0.0:
        return limit
    shape, total, turned = model.shape, 0.0, 0.0
    for i in range(ONE, uint64(model.n1)):
        along = max(shape.h1[i - ONE] * (1.0 + by_row.e1[i - ONE]), shape.h1[i] * (1.0 + by_row.e1[i]))
        around, per_mass = shape.h2[i] * (1.0 + by_row.e2[i]), model.per_mass[i]
        total += (model.hoop.gas * along * around) ** 2 * per_mass
        turned = max(turned, model.hoop.gas * per_mass * (along + around))
    columns = model.hoop.whole
    total = columns * (model.n2 * total + model.cover_area * model.cover_area / model.cargo_mass)
    rate = 1.0 / limit
    square = stiffness(model.gas, state.gas, total) + max(state.now[History.PRESSURE] - model.pressure.most, 0.0) * turned
    limit = 2.0 / (rate + sqrt(rate * rate + square) + venting_rate(model.gas, state.gas))
    return min(limit, shrinking_limit(state.gas, state.last_step[0]))


@kernel
def shrinking_limit(chamber, last_step):
    """Return the step (s) in which the volume falls by PART_OF_VOLUME, as fast as in the last one (s); infinite where it grows.

    A longer one would go past what the last of the gas does, and throw the cargo back.
    """
    fallen, left = chamber[GasState.VOLUME] - chamber[GasState.NEXT_VOLUME], chamber[GasState.NEXT_VOLUME]
    if fallen <= 0.0 or left <= chamber[GasState.LEAST_VOLUME]:
        return inf
    return PART_OF_VOLUME * last_step * left / fallen


@kernel
def stiffness(gas, chamber, areas):
    """Return w² (1/s^2) of the gas for the sum of squared areas over masses (m^4/kg)."""
    return gas.exponent * chamber[GasState.PRESSURE] * areas / min(chamber[GasState.VOLUME], chamber[GasState.FREE_VOLUME])


@kernel
def venting_rate(gas, chamber):
    """Return how fast (1/s) the gas can leave at most, at the speed of sound."""
    area = gas.leakage * chamber[GasState.FREE_AREA]
    for k in range(gas.vents.shape[0]):
        area += gas.vents[k, VentConstant.AREA]
    volume = chamber[GasState.VOLUME]
    return area / volume * sqrt(gas.gamma * chamber[GasState.PRESSURE] * volume / chamber[GasState.MASS])
