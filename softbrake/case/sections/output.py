"""Section `output`: what the result file keeps."""

from __future__ import annotations

from dataclasses import dataclass

from softbrake.case.keys import Key
from softbrake.case.section import Draft, Part, Section
from softbrake.case.units import Dimension

CFC = (60, 180, 600, 1000)  # channel frequency classes of SAE J211
CFC_DEFAULT = 180
PICTURES = 150  # of the whole shell in a run, by default


@dataclass(frozen=True)
class Output(Part):
    """What the result file keeps."""

    snapshot_interval: float  # s between pictures of the whole shell
    history_interval: int  # steps between rows of /history
    cfc: int  # channel frequency class of the filtered peaks


class _OutputSection(Section):
    def build(self, draft: Draft) -> Output:
        """Pictures all over the run by default."""
        return Output(**{"snapshot_interval": draft.built("time").end / PICTURES, **draft.values(self.name)})


OUTPUT = _OutputSection(
    "output",
    Output,
    (
        Key("snapshot_interval", Dimension.TIME, "between pictures of the shell", "2 ms", computed="time.end/150", above=0),
        Key("history_interval", int, "steps between rows of the history", "1", default=1, least=1),
        Key("cfc", CFC, "channel frequency class (SAE J211) of filtered peaks", "180", default=CFC_DEFAULT),
    ),
    optional=True,
)
