"""What the kernels of contact between rows read: a ContactScene of the shell or of a meridian."""

from softbrake.core.arrays import PAD, ContactScene, Sheet
from softbrake.core.contact.obstacles import in_the_way, may_touch
from softbrake.core.jit import kernel


@kernel
def scene_of_shell(model, step, touching):
    """Return the ContactScene of the shell; touching: whether cover and cargo are in the way."""
    edge = min(model.shape.least_1, model.shape.least_2)
    sheet = Sheet(model.n1, model.n2, model.stride, PAD, 0.0, edge, in_the_way(model.obstacles, touching))
    return ContactScene(model.mass, step, sheet)


@kernel
def scene_of_meridian(model, step):
    """Return the ContactScene of a meridian."""
    obstacles, edge = model.obstacles, model.shape.least_1
    sheet = Sheet(model.n1, 1, 1, 0, 0.5 * edge, edge, in_the_way(obstacles, may_touch(obstacles)))
    return ContactScene(model.mass, step, sheet)


@kernel
def available_space(scene):
    """Return what thicknesses are a part of (m): the edge, or the space between ground and cover where that is narrower.

    Cloth has no thickness to be squeezed. A fixed thickness would fill what is left under the cover, and ground and cover, both
    rigid, would drive the cloth between them to and fro in each step anew: a force that grows as steps shrink.
    """
    sheet, obstacles = scene.sheet, scene.sheet.obstacles
    return min(sheet.edge, scene.step.next_cover - obstacles.ground) if obstacles.cover == 1 else sheet.edge
