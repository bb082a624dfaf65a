"""All tuning constants of contact: meaning, unit, origin. A part of something has no unit.

Origin: "chosen" means that no measurement of the value is on record. BFA: Bridson, Fedkiw, Anderson, Robust treatment of
collisions, contact and friction for cloth animation (2002). Log: docs/validation/log.md. An edge is one of the unloaded cell.
"""

# --- obstacles: ground, cover, cargo, axis ------------------------------------------------------------------------------------
GAP = 1e-6  # m, least distance kept from the cover and from the axis, so that the side on which a node lies shows; chosen
ACCELERATION_JUMP = 100.0  # m/s^2, change of the cargo's acceleration from step to step that the gap allows for; chosen
LAST_GAP = 0.25  # of the cover's height, most of the gap, so that it vanishes with the space; chosen
LAST_SPACE = 1e-9  # m, left between ground and cover at the impact, far above round-off; there folds pass freely; chosen
LYING = 1e-9  # part of the cargo's radius and of the gap within which a node lies on a face; chosen, far above round-off

# --- thickness of the cloth: the first passes over the active pairs -----------------------------------------------------------
THICKNESS = 0.02  # edges, or parts of the space between ground and cover where that is less; chosen
SPRING = 0.5  # part of what a thickness is compressed, given back in a step; chosen
THICKNESS_REBOUND = 0.5  # of the speed of closing, most that is given back, so that a resting pair stays at rest; chosen
THICKNESS_PASSES = 4  # passes (Gauss-Seidel) over the thicknesses; chosen
TINY_THICKNESS = 1e-3  # thicknesses; nearer than this the direction from face to node is round-off; chosen

# --- collisions: continuous detection, until nothing passes -------------------------------------------------------------------
COLLISION_GAP = 1e-3  # edges, or parts of the space as above, at which a pair that would pass is held; chosen
COLLISION_PASSES = 60  # passes, and as many more with rigid zones; what still passes is counted as missed; chosen
EXACT_PASSES = 4  # passes that take the impulse needed and no more; chosen
OVERRELAXATION = 1.2  # of the impulse needed, in later passes: fewer passes where other pairs push one back; chosen
HELD_PART = 0.99  # of the distance to be kept: the rest would take passes without end where a corner lies on the cargo; chosen
TINY_GAP = 1e-3  # collision gaps; nearer than this the direction from face to node is round-off; chosen
TOO_NEAR = 0.1  # collision gaps; what was nearer rebounds, lest round-off decide; chosen
NEAR_REBOUND = 0.5  # of the speed of closing, of what was too near; chosen
LEAST_MOBILITY = 0.01  # 1/m of a pair over that of a free node: less would multiply impulses without bound; chosen

# --- narrow phase: round-off --------------------------------------------------------------------------------------------------
ROUND_OFF = 1e-12  # collision gaps, by which what lies in one plane seems to pass; chosen
SMALLEST = 1e-30  # m, against division by zero
PARALLEL = 1e-12  # sine squared of two edges, below which round-off would choose where they are nearest; chosen
ROOT_PRECISION = 1e-15  # of the time since the last contact
ROOT_STEPS = 60  # most, if all halve the bracket
RIM = 1e-8  # share by which a triangle is widened, so that nothing slips through between two; chosen, the root of round-off

SINGLE = 1e-6  # part of a distance by which it is shortened for single precision, some ten times its round-off

# --- broad phase: search for near pairs ---------------------------------------------------------------------------------------
BATCH = 128  # pairs whose nearest points are found in one go: 20 KB, less than the fastest cache has
BLOCK = 4  # cells along each side of a block; chosen
SMOOTH_COSINE = 0.7  # of the angle of normals, 45°, within which blocks are smooth; the criterion is Volino's and Provot's
TRAVEL_ALLOWANCE = 1.25  # of the travel before contact, since impulses make some nodes faster; chosen
REST_MARGIN = 0.06  # edges, margin of a node at rest; chosen
MARGIN_STEPS = 8.0  # steps at the present speed, margin of a node that moves, however many a look is over; chosen
MOST_SCALE = 2.0  # of the margins; chosen
FEW_PAIRS, MANY_PAIRS = 0.3, 3.0  # per face: margins grow below and shrink above; chosen

# --- when self-contact is due, and how long a step may be ---------------------------------------------------------------------
NEARLY_THERE = 3.0  # steps of the cover before the ground in which self-contact is looked at in each; chosen
IDLE_STEPS = 4  # steps until self-contact is looked at again where no pair was active; chosen
UPRIGHT = 0.1  # edges that each edge climbs, or goes round, at least where no self-contact is possible; chosen
# Log: layers thrown through 0.125 edges in a step lost nodes, through 0.06 none; stable steps take 0.02.
WATCHED_TRAVEL = 0.125  # edges that the fastest node goes in a step, so two near each other by a quarter; chosen

# --- belts: condition (2.5) ---------------------------------------------------------------------------------------------------
NEARLY_SQUARE = 100.0  # cosine^-2 of 84°: cloth at a belt may fold within a step from less than 96° apart; chosen
OPPOSED = 2.0  # square of the difference of two unit normals that are at a right angle: beyond, lobes lie on each other
