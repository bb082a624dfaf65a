"""The arrays of a run: Model is constant, State changes. Unit and shape of each field stand here, once.

Grid. Row i = 0 … n1 counts nodes along the generatrix, from the lower cover on the ground (0) to the upper cover under the
cargo (n1); column j = 0 … n2-1 counts them around the hoop. A row is stored with one copy of its last column in front and of
its first column behind, so node (i, j) of a flat array stands at `i*stride + PAD + j`, columns -1 … n2. PAD and stride are
multiples of eight doubles, a cache line, and loops over a row take whole ones: a row has room for the columns from n2 on that
they compute and nobody reads. The axisymmetric shell is one column, which the rest of the hoop repeats, kept as one array along
the generatrix with PAD entries more: x the radius, y and v zero.
Suffix _1 is along the generatrix, _2 around the hoop. x3 = z points up.
"""

from enum import IntEnum
from typing import NamedTuple

from numpy import float32, float64, int64, uint32
from numpy.typing import NDArray

PAD = 8
Floats = NDArray[float64]
Ints = NDArray[int64]
Singles = NDArray[float32]
Indices = NDArray[uint32]


class Outcome(IntEnum):
    """Why the loop over steps ended; RUNNING where it only paused."""

    RUNNING = 0
    IMPACT = 1
    STOPPED = 2
    TIME_LIMIT = 3
    DIVERGED = 4
    REBOUND = 5  # the cover is back at the height of first contact


class After(IntEnum):
    """Whether a run goes on where the cargo stands still."""

    STOP = 0
    TOP = 1  # until it leaves the ground, or turns back on its way up: a gas without ways in and out has less to give then
    REBOUND = 2  # until it leaves the ground


class Peak(IntEnum):
    """Rows of `State.peaks` and `State.overshoot`: largest value of a phase, its time and its row."""

    DECELERATION = 0  # m/s^2, of the cargo
    TENSION_GENERATRIX = 1  # N/m
    TENSION_HOOP = 2  # N/m
    TENSION_BELT = 3  # N/m
    PRESSURE = 4  # Pa, gauge, of a gas with a state
    TEMPERATURE = 5  # K, likewise


class Motion(IntEnum):
    """Elements of `State.motion`."""

    LOWEST = 0  # m, height of the cover where it stood still; infinite before
    REST_TIME = 1  # s, at which it first stood still; infinite before


class VentConstant(IntEnum):
    """First columns of `Gas.vents`; what is not asked for is out of reach."""

    AREA = 0  # m^2
    OPENS_AT_PRESSURE = 1  # Pa, gauge
    OPENS_AT_TIME = 2  # s; -inf: open from the start
    OPENS_AT_HEIGHT = 3  # m, of the cover on its way down
    CLOSES_AT_PRESSURE = 4  # Pa, gauge
    CLOSES_AT_HEIGHT = 5  # m, of the cover: for good
    INFLOW = 6  # 1: ambient gas may flow in


class VentState(IntEnum):
    """Columns of `State.vents`."""

    OPEN = 0  # 1 or 0
    SHARE = 1  # of the step under way, in which it is open; OPEN between steps
    OPENED_AT = 2  # s, first; infinite before
    SHUT = 3  # 1: closed for good


class GasState(IntEnum):
    """Elements of `State.gas`: at TIME, to which gas and vents have come."""

    TIME = 0  # s
    HEIGHT = 1  # m, of the cover
    VOLUME = 2  # m^3, of the shell
    NEXT_VOLUME = 3  # m^3, at the end of the step
    MASS = 4  # kg
    FREE_VOLUME = 5  # m^3, that the gas would take at ambient pressure along its process: its entropy
    PRESSURE = 6  # Pa, absolute
    FREE_AREA = 7  # m^2, of the wall that nothing lies on, in the step
    VENTED = 8  # kg, out through vents and wall since the start
    FILLED = 9  # kg, in since the start
    EXPECTED_VOLUME = 10  # m^3, at the end of the last step by the volume and its rate at its start
    EXPECTED_AFTER = 11  # s, how long that step was; 0 where nothing was expected
    CURVATURE = 12  # m^3/s^2, of the volume over the step: what that was off over the square of the step
    LEAST_VOLUME = 13  # m^3, that the gas is left where the shell's is less, or turned inside out


class ContactCount(IntEnum):
    """Entries of `SelfContact.counts`."""

    DUE = 0  # 1: self-contact is possible until the next choice of the step
    STALE = 1  # 1: near pairs are to be searched for anew
    FACES = 2  # near pairs of a node and a face, and of two edges; more than `NearPairs` holds where it has overflown
    EDGES = 3
    ACTIVE = 4  # active pairs; likewise of `ActivePairs`
    OPEN = 5  # steps since the last contact, which the next one makes good for
    MISSED = 6  # missed collisions: pairs that passed each other, at each contact, over the run
    SEARCHES = 7  # over the run
    TESTS = 8  # of boxes in them
    PASSES = 9  # over the active pairs, over the run


class Meeting(IntEnum):
    """Contact between rows in a step."""

    NONE = 0  # not possible
    LATER = 1  # left to a later step, which knows where all was before this one
    NOW = 2


class Box(IntEnum):
    """Columns of `SelfContact.blocks` and boxes: a box (m) around a block of cloth, and the cone of its normals."""

    LOW_X = 0
    LOW_Y = 1
    LOW_Z = 2
    HIGH_X = 3
    HIGH_Y = 4
    HIGH_Z = 5
    NORMAL_X = 6
    NORMAL_Y = 7
    NORMAL_Z = 8
    SPREAD = 9  # rad, widest angle of a normal from that
    MARGIN = 10  # m, largest of its nodes


class Place(IntEnum):
    """Columns of `Records.place`: where a node was at the last contact, m."""

    X = 0
    Y = 1
    Z = 2


class Speed(IntEnum):
    """Columns of `Records.speed`: how a node has moved since the last contact."""

    U = 0  # m/s, mean velocity
    V = 1
    W = 2
    PER_MASS = 3  # 1/kg, 0 of a node that ground or cover holds


class StateColumn(IntEnum):
    """Columns of `ActivePairs.state`: see contact.pairs.PairState."""

    NORMAL_X = 0
    NORMAL_Y = 1
    NORMAL_Z = 2
    WEIGHT_0 = 3
    WEIGHT_1 = 4
    WEIGHT_2 = 5
    WEIGHT_3 = 6
    ALLOWED = 7  # m/s
    REACH = 8  # m


class PressureLaw(IntEnum):
    """Course of p~ in time."""

    CONSTANT = 0
    SINE = 1
    TABLE = 2


class Source(IntEnum):
    """Of energy that no force can have given: elements of `State.made`."""

    FABRIC = 0  # elastic work beyond what was stored at the start
    BELTS = 1  # likewise
    VISCOSITY = 2  # work, which may not be positive


class Law(IntEnum):
    """Tension over elongation."""

    TENSION_FIELD = 0  # derivative of the relaxed energy, per unloaded width
    NOMINAL_TENSION = 1  # (2.9) per unloaded width
    TRUE_TENSION = 2  # (2.9) per deformed width, as printed


class Scheme(IntEnum):
    """Where tensions and directions stand: on the edges, or at cell centres as (3.2) is printed."""

    EDGE = 0
    CELL = 1


class Membrane(NamedTuple):
    """Constants of the tension law on cells of one size: `Model.fabric` has that of the lowest row, core.shape others."""

    law: int  # Law
    h1: float  # m, unloaded edge along the generatrix
    h2: float  # m, unloaded edge around the hoop: the chord between two columns
    e11: float  # N/m, E11: of e11 where wrinkles free the hoop
    e22: float  # N/m, E22
    c11: float  # N/m, E11/(1 - nu12 nu21)
    c22: float  # N/m, E22/(1 - nu12 nu21)
    c12: float  # N/m, nu12 E11/(1 - nu12 nu21) = nu21 E22/(1 - nu12 nu21), of e22 in T11 and of e11 in T22
    g12: float  # N/m
    viscosity: float  # N s/m
    floor: float  # N/m, least tension of (2.9): 0, or -inf where fabric resists compression
    true_tension: float  # 1: tensions per deformed width; 0: per unloaded width


class Belts(NamedTuple):
    """Belt constants of each row, shape (n1+1,); zero where a row carries no belt. Eq. (2.3)."""

    width: Floats  # m, of belt within the row's share of the generatrix
    stiffness: Floats  # N, E2/(1 - nu12 nu21) under true tensions, else E2
    coupling: Floats  # N, nu12 E11 width/(1 - nu12 nu21) under true tensions, else 0
    viscosity: Floats  # N s


class BeltContact(NamedTuple):
    """Where condition (2.5) looks, each (belts,); none where it is not asked for."""

    below: Ints  # row next to each belt on its lower side
    above: Ints  # on its upper side


class GasPressure(NamedTuple):
    """Constants of Eqs. (2.10), (2.11)."""

    law: int  # PressureLaw
    value: float  # Pa
    peak_time: float  # s
    end_time: float  # s
    times: Floats  # s, (k,)
    values: Floats  # Pa, (k,)
    damping: float  # s/m
    most: float  # Pa, largest p~ of the law


class Gas(NamedTuple):
    """Constants of a gas with a state, of its surroundings and of the ways in and out. See core.gas."""

    exponent: float  # n of P V^n; 0: no gas with a state, the pressure follows GasPressure
    gamma: float
    gas_constant: float  # J/(kg K)
    choking: float  # ratio of ambient to inside pressure at and below which the flow is that of sound
    choked_root: float  # the ratio of densities there, choking^(1/gamma)
    ambient_pressure: float  # Pa
    ambient_temperature: float  # K
    closed: int  # 1: nothing gets in or out
    leaks: int  # 1: the wall lets some out
    leakage: float  # effective part of the free wall area
    linear: float  # m/(s Pa), of u over p through the wall
    quadratic: float  # m/(s Pa^2)
    viscous: float  # Pa s/m, of p over u
    inertial: float  # Pa s^2/m^2
    inflow_temperature: float  # K
    inflow: Floats  # (2, k), of an inflator: times, s, and mass flow, kg/s
    vents: Floats  # (vents, len(VentConstant) + 2k): behind the constants k ratios of ambient to inside pressure, increasing, and
    # k coefficients of discharge there, linear between and level outside


class Obstacles(NamedTuple):
    """What stops the fabric: ground, the cover under the cargo, the cargo, the axis. See core.contact.obstacles."""

    ground: float  # m, height of the ground: 0, or -inf without contact
    friction: float  # Coulomb's coefficient on ground and cover
    cover: int  # 1: the disc under the cargo, from both sides
    cover_radius: float  # m
    cargo: int  # 1: the cylinder on the cover
    cargo_radius: float  # m
    cargo_height: float  # m
    axis: int  # 1: radii of the axisymmetric shell stay positive


class Shape(NamedTuple):
    """The unloaded shell."""

    h1: Floats  # m, edge along the generatrix above each row of nodes, (n1+1,), the last as that below
    h2: Floats  # m, edge around the hoop at each row, likewise: the chord between two columns
    radius: Floats  # m, of each row, likewise
    side: float  # rad, angle of an edge around the hoop: h2 over the radius
    least_1: float  # m, shortest edge along the generatrix
    least_2: float  # m, around the hoop
    widest: float  # m, largest radius


class Hoop(NamedTuple):
    """How the columns make up the hoop, a circle."""

    whole: float  # circumference over the unloaded edges of the columns, which are chords: a little over 1 where they are all
    gas: float  # area between arcs over that between chords, per length of cloth: 1/cos of half the angle between two columns
    cos: float  # of the angle between two columns


class Model(NamedTuple):
    """All that stays constant in a run."""

    n1: int  # cells along the generatrix
    n2: int  # columns: the cells around the hoop, or one
    stride: int  # doubles from row to row, see above; 1 of the axisymmetric shell
    scheme: int  # Scheme
    courant: float
    end: float  # s
    gravity: float  # m/s^2
    height: float  # m, of the cover at first contact
    after: int  # After: whether the run goes on where the cargo first stands still
    crushing: float  # m, height of the cover at which the overshoot is over and crushing begins
    cargo_mass: float  # kg, without the shell; the columns' share
    cover_area: float  # m^2, of the upper cover, the columns' share
    base_area: float  # m^2, of the lower cover, likewise
    piston_area: float  # m^2, of a cylinder of the shell's height and volume, likewise: the lumped model
    most_gas_work: float  # J, more than gas can give: largest pressure times the volume at twice the diameter
    mass: Floats  # kg, of a node of each row, (n1+1,)
    per_mass: Floats  # 1/kg, likewise, zero for the held rows 0 and n1
    below: Floats  # 1/kg, of both ends of the edge below a row, the other one's weighed, for the bound of the step; likewise
    above: Floats  # 1/kg, above it
    shared: Floats  # 1/kg, four over the mass, which rows share whose hoops the printed scheme averages; likewise
    shape: Shape
    fabric: Membrane
    belts: Belts
    belt_contact: BeltContact
    pressure: GasPressure
    gas: Gas
    obstacles: Obstacles
    hoop: Hoop


class Step(NamedTuple):
    """The step from n to n+1, as all rows of nodes see it."""

    dt: float  # s, from n-1/2 to n+1/2
    length: float  # s, from n to n+1
    gravity: float  # m/s^2
    cover: float  # m, height of the cover at n
    next_cover: float  # m, at n+1, as foreseen
    gap: float  # m, kept from the cover by what lies on it


class Sheet(NamedTuple):
    """How nodes and faces of a shell or a meridian are numbered, and what stops them."""

    rows: int  # of faces; rows 0 and `rows` of nodes are held
    columns: int  # 1: a meridian
    stride: int  # from row to row of nodes; 1 for a meridian
    first: int  # node of row 0, column 0
    breadth: float  # m, half of it, of a meridian's faces across the half-plane; 0 for a shell
    edge: float  # m, shorter one of the unloaded cell
    obstacles: Obstacles  # as far as in the way in this step


class ContactScene(NamedTuple):
    """What the kernels of contact between rows read."""

    mass: Floats  # kg, of a node of each row
    step: Step
    sheet: Sheet


class Nodes(NamedTuple):
    """Places (m) at time n and velocities (m/s) at n-1/2, each flat, ((n1+1)*stride,); (n1+1+PAD,) of one column."""

    x: Floats
    y: Floats
    z: Floats
    u: Floats
    v: Floats
    w: Floats


class WorkByColumn(NamedTuple):
    """Work on the columns of the shell and their share of the cargo since the start, J, by column; each (n2 in whole PADs,).

    Split by node of the one column, (n1+1+PAD,), in the axisymmetric shell.
    """

    pressure: Floats
    elastic: Floats  # of fabric tensions and shear
    viscous: Floats  # of fabric and belts
    belts: Floats
    gravity: Floats
    ground: Floats
    contact: Floats  # of what stops the fabric but the ground, and of friction


class Records(NamedTuple):
    """The nodes in the time since the last contact: see contact.records. Half a cache line each, of what is read together."""

    place: Floats  # (nodes, 4): see Place
    speed: Floats  # (nodes, len(Speed))
    stamp: Indices  # (nodes,), pass in which a node last took an impulse


class NearPairs(NamedTuple):
    """Pairs near one another, each array (capacity,): of nodes and faces from the front, of edges from the end."""

    first: Indices  # node, or first edge
    second: Indices  # face, or second edge: see contact.pairs
    active_from: Singles  # m, travel of node and face, or of both edges, at which a pair is to be looked at again


class ActivePairs(NamedTuple):
    """Pairs that may meet before the contact under way: first those of nodes and faces, then those of edges."""

    nodes: Indices  # (capacity, 5), of the shell's own columns, not of their copies: see contact.pairs
    state: Singles  # (capacity, len(StateColumn)), when the last contact was


class SelfContact(NamedTuple):
    """Near pairs of nodes and faces, and of edges, and the search for them (broad phase).

    What bounds a way, or finds a pair, is in single precision.
    """

    record: Records
    pairs: NearPairs
    active: ActivePairs
    path: Singles  # m, (nodes,), travelled since the last search
    travel: Singles  # m, (2 nodes,), most that each node can have travelled since the last contact; then each face, by node
    reached: Singles  # m, (2 nodes,), likewise, since the last search
    margin: Singles  # m, (nodes,), that may be travelled until the next search
    home: Indices  # (nodes,), of which column's node each is a copy
    since: Floats  # (3,), of the last contact: s since, m, height of the cover then, s, see self_contact.shift_of
    scale: Floats  # (1,), of the margins
    normal: Singles  # (nodes, 3), of the cloth at the last search, shorter than 1 where it is creased
    cell_box: Floats  # m, (7, nodes), low and high x, y, z and margin of each face, or edge on the cover
    blocks: Floats  # (blocks, len(Box))
    order: Ints  # (blocks,), by lower x
    cells: Ints  # (cells of two blocks,), scratch
    boxes: Floats  # (8, cells of two blocks), scratch
    given: Floats  # m, (12, BATCH), scratch: corners of some pairs seen from the node
    found: Floats  # (9, BATCH), scratch: where these are nearest
    due: Indices  # (2, BATCH + 1), scratch: their numbers
    zone: Indices  # (nodes,), scratch: see contact.impact_zones
    counts: Ints  # (len(ContactCount),)
    penetration: Floats  # (1,), largest so far, over the unloaded cell


class Impulses(NamedTuple):
    """Where the impulses of contact between rows, at belts and of self-contact, are recorded."""

    contact: Floats  # J, work on the nodes, by column, or by node of a meridian
    kinetic: Floats  # J, energy of the nodes, likewise
    impulse: Floats  # N s, (2,), upwards: on the cargo, of the ground on the fabric


class State(NamedTuple):
    """All that changes from step to step and must outlive it."""

    nodes: Nodes
    now: Floats  # (len(History),), see History
    steps: Ints  # (1,), steps done
    choice: Ints  # (2,), of the step: due after so many steps, and the number of steps that was from the last one
    stable_step: Floats  # (2,), s: as last chosen, at Courant coefficient 1, and the limit found then
    last_step: Floats  # (1,), s, the step from n-1 to n; 0 at the start, which staggers it
    kinetic_start: Floats  # (1,), J
    stored: Floats  # (2,), J, in fabric and in belts at the start
    made: Floats  # (len(Source),), J, largest so far of what each gave beyond what it had
    peaks: Floats  # (len(Peak), 3), of the phase under way: value, time (s), row
    overshoot: Floats  # likewise, of the overshoot once it is over, before that zero
    filtered_deceleration: Floats  # (1,) m/s^2, acceleration of the cargo behind a low-pass
    motion: Floats  # (len(Motion),)
    gas: Floats  # (len(GasState),)
    vents: Floats  # (vents, len(VentState))
    work: WorkByColumn
    self_contact: SelfContact | None  # None where it is not asked for: kernels without it are compiled in half of the time


class Edges(NamedTuple):
    """A few rows of edges of one direction, kept while the walk over rows needs them; each flat, (rows*stride,)."""

    x: Floats  # m, edge vector
    y: Floats
    z: Floats
    e: Floats  # elongation, stretch - 1
    inverse: Floats  # 1/m, of the length
    rate: Floats  # 1/s, of e at n-1/2
    force: Floats  # N/m, edge force over edge length
    elastic: Floats  # N/m, its elastic part


class BeltRow(NamedTuple):
    """The belt on a row of hoop edges; each (stride,)."""

    force: Floats  # N/m, belt force over edge length
    elastic: Floats  # N/m, its elastic part


class Cells(NamedTuple):
    """Two rows of cells, for shear and for the printed scheme; each flat, (2*stride,), N/m."""

    force_1: Floats  # corner force over the sum of the cell's two generatrix edges
    elastic_1: Floats  # its elastic part
    force_2: Floats  # corner force over the sum of the cell's two hoop edges
    elastic_2: Floats  # its elastic part
    shear: Floats  # corner force of T12 over the sum of the two edges of the other direction


class Row(NamedTuple):
    """A row of a walk over the shell, and where its parts stand in flat arrays, see core.loop.rows."""

    i: int
    node: int  # its column 0 of nodes
    row: int  # of two rows of mean velocities, cells and generatrix edges: its own, those above it
    below: int  # those of the row below, and below it
    hoop: int  # of three rows of hoop edges: its own
    hoop_above: int  # those of the row above
    hoop_below: int
    has_below: bool  # whether the walk has a row below
    has_above: bool
    inside: bool  # whether it has both: its nodes are free
    belted: bool  # whether it is free and carries a belt


class Vectors(NamedTuple):
    """One row of vectors at the nodes, or two; each flat, (rows*stride,)."""

    x: Floats
    y: Floats
    z: Floats


class ByRow(NamedTuple):
    """What the last choice of the step found at each row of nodes; each (n1+1,), zero at held rows."""

    e1: Floats  # largest elongation of the edges above, not below 0
    e2: Floats  # of the hoop's
    skew: Floats  # largest squared cosine between an edge of either direction; of the meridian and the radius
    rate: Floats  # 1/s, two over the longest step


class Meridian(NamedTuple):
    """Scratch of the axisymmetric shell's step, each (n1+1+PAD,): values of edges, n1 of them, in front, and of nodes."""

    x: Floats  # m, edge vector, along the radius
    z: Floats  # m, upwards
    e: Floats  # elongation
    tension_1: Floats  # N/m, T11
    force: Floats  # N/m, edge force over edge length
    elastic: Floats  # N/m, its elastic part
    tension_2: Floats  # N/m, T22 at the nodes
    belt_force: Floats  # N, tension of the belt
    belt_elastic: Floats  # N, of its elastic part on the node, inwards
    pressure: Floats  # Pa
    mass: Floats  # kg, of the free nodes, 0 of all others
    per_mass: Floats  # 1/kg, likewise
    per_1: Floats  # 1/m, over the unloaded length of an edge
    per_2: Floats  # 1/m, hoop's stretch over the radius of a node
    width_1: Floats  # m, unloaded, of the cloth along an edge
    width_2: Floats  # m, unloaded, of the cloth along a node's hoop
    belts: Belts  # likewise
    hoop: Floats  # N, of the fabric's hoop and the belt on the node, inwards
    hoop_elastic: Floats  # N, of the elastic part of the fabric's
    mean_u: Floats  # m/s, mean of the velocities at n-1/2 and n+1/2
    mean_w: Floats  # m/s
    free_u: Floats  # m/s, at n+1/2 before contact, but that with the ground
    free_w: Floats  # m/s
    kinetic: Floats  # J
    contact: Floats  # J, scratch
    volume: Floats  # m^3, scratch, below an edge
    free: Floats  # m^2, of the wall at a node that lies on nothing
    ground_impulse: Floats  # N s, of the ground on the node in the push
    impulse: Floats  # (2,), N s, as in Impulses
    by_row: ByRow
    area: Vectors  # m^2, area vectors of the nodes outwards; node i at PAD + i
    belt_rows: Ints  # rows that carry a belt


class RunningMaximum(NamedTuple):
    """Largest tension of the step by column, and its row (i + 1/2 between two rows); each (n2 in whole PADs,)."""

    tension: Floats  # N/m
    row: Floats


class ByColumn(NamedTuple):
    """Sums of the step by column; each (n2 in whole PADs,)."""

    kinetic: Floats  # J
    ground_impulse: Floats  # N s, of the ground on the fabric of the row under way
    impulse: Floats  # N s, of the ground on the fabric of all rows so far
    on_ground: Floats  # m^2, of the fabric on the ground
    on_cargo: Floats  # N s, of the fabric on cover and cargo, upwards
    flux: Floats  # m^3, of the places at n+1 through the area vectors at n, for the volume
    swept: Floats  # m^3/s, of the velocities at n+1/2 through them
    free: Floats  # m^2, of the wall that lies on nothing
    rate: Floats  # scratch between steps


class BeforeContact(NamedTuple):
    """The shell before contact between rows in the step, each (nodes,), or of size 1 where neither is asked for."""

    before: Nodes  # velocities at n-1/2; of the rows that took impulses and their neighbours also the places at n
    jump: Vectors  # m/s, what it changed of the velocities; kept for the next step
    impulse: Floats  # (2,), N s, as in Impulses


class Workspace(NamedTuple):
    """Scratch of one step, row by row; nothing in it outlives the step."""

    generatrix: Edges  # 2 rows
    hoop: Edges  # 3 rows
    belt: BeltRow
    tension_1: Floats  # N/m, T11 of the row under way, (stride,)
    tension_2: Floats  # N/m, T22 or N22
    cells: Cells
    force: Vectors  # N, of tensions on the nodes of the row under way
    force_above: Vectors  # N, on the nodes of the next row, from the cells below it
    area: Vectors  # m^2, area vectors of the nodes of the row under way, outwards
    mean: Vectors  # m/s, mean of the velocities at n-1/2 and n+1/2; 2 rows
    pressure: Floats  # Pa, on the nodes of a row, (n2 in whole PADs,)
    maximum_generatrix: RunningMaximum
    maximum_hoop: RunningMaximum
    maximum_belt: RunningMaximum
    by_column: ByColumn
    by_row: ByRow
    before_contact: BeforeContact
