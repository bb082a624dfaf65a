"""A sidecar for readers that know XDMF and not VTKHDF: it points into the result file and copies nothing."""

from __future__ import annotations

import os
from pathlib import Path
from typing import NamedTuple
from xml.etree.ElementTree import Element, ElementTree, SubElement

from softbrake.sim.files import draft_of
from softbrake.sim.result_file import POINT_FIELDS, Layout, ResultError, read_layout


class _Block(NamedTuple):
    """Cells of one kind, which lie side by side in the result file."""

    name: str
    topology: str  # in the words of XDMF
    cells: int
    corners: int  # of each
    connectivity: str  # dataset
    entry: int  # of it, where the block begins
    cell: int  # of all cells, where it begins
    fields: bool  # whether the nodes' fields mean something there


def write_xdmf(result: Path | str, file: Path | str) -> None:
    """Write the sidecar of a result file: a spatial collection of shell, belts, covers and ground for each snapshot.

    It finds the result file by its place relative to the sidecar. Raises ResultError and OSError.
    """
    layout = read_layout(result)
    if not len(layout.times):
        raise ResultError(f"{result}: the run stopped before it recorded anything")
    place = Path(os.path.relpath(Path(result).resolve(), Path(file).resolve().parent)).as_posix()
    root = Element("Xdmf", Version="2.0")
    steps = SubElement(SubElement(root, "Domain"), "Grid", Name="drop", GridType="Collection", CollectionType="Temporal")
    for step, time in enumerate(layout.times):
        parts = SubElement(steps, "Grid", Name=f"snapshot {step}", GridType="Collection", CollectionType="Spatial")
        SubElement(parts, "Time", Value=repr(float(time)))
        for block in _blocks(layout):
            _write_block(parts, block, step, layout, f"{place}:/VTKHDF")
    with draft_of(file) as draft:
        ElementTree(root).write(draft, encoding="utf-8", xml_declaration=True)


def _blocks(layout: Layout) -> list[_Block]:
    """In the order of the file: lines, then polygons."""
    n1, n2, belts = layout.generatrix, layout.hoop, layout.belts
    wall = n1 * n2
    blocks = [
        _Block("shell", "Quadrilateral", wall, 4, "Polygons", 0, belts, True),
        _Block("covers", "Polygon", 2, n2, "Polygons", 4 * wall, belts + wall, False),
        _Block("ground", "Quadrilateral", 1, 4, "Polygons", 4 * wall + 2 * n2, belts + wall + 2, False),
    ]
    return [*blocks, _Block("belts", "Polyline", belts, n2 + 1, "Lines", 0, 0, True)] if belts else blocks


def _write_block(parent: Element, block: _Block, step: int, layout: Layout, root: str) -> None:
    grid = SubElement(parent, "Grid", Name=block.name, GridType="Uniform")
    topology = SubElement(
        grid,
        "Topology",
        TopologyType=block.topology,
        NumberOfElements=str(block.cells),
        NodesPerElement=str(block.corners),
    )
    entries = block.cells * block.corners
    whole = layout.connectivity[block.connectivity]
    _write_slab(topology, f"{root}/{block.connectivity}/Connectivity", (whole,), block.entry, entries, "Int", 8)
    steps, points, cells = len(layout.times), layout.points, layout.cells
    geometry = SubElement(grid, "Geometry", GeometryType="XYZ")
    _write_slab(geometry, f"{root}/Points", (steps * points, 3), step * points, points)
    for name, field in POINT_FIELDS.items() if block.fields else ():
        kind = "Vector" if field.components else "Scalar"
        attribute = SubElement(grid, "Attribute", Name=name, AttributeType=kind, Center="Node")
        _write_slab(attribute, f"{root}/PointData/{name}", (steps * points, *field.components), step * points, points)
    attribute = SubElement(grid, "Attribute", Name="pressure", AttributeType="Scalar", Center="Cell")
    _write_slab(attribute, f"{root}/CellData/pressure", (steps * cells,), step * cells + block.cell, block.cells)


def _write_slab(
    parent: Element, dataset: str, shape: tuple[int, ...], first: int, rows: int, kind: str = "Float", size: int = 4
) -> None:
    """Rows of a dataset of a shape, from the first on."""
    rest = shape[1:]
    slab = SubElement(parent, "DataItem", ItemType="HyperSlab", Type="HyperSlab", Dimensions=_words((rows, *rest)))
    which = SubElement(slab, "DataItem", Format="XML", Dimensions=f"3 {len(shape)}")
    which.text = _words((first, *(0 for _ in rest), *(1 for _ in shape), rows, *rest))
    source = SubElement(slab, "DataItem", Format="HDF", Dimensions=_words(shape), NumberType=kind, Precision=str(size))
    source.text = dataset


def _words(numbers: tuple[int, ...]) -> str:
    return " ".join(map(str, numbers))
