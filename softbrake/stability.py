"""Map of the largest stable step: found by bisection over short runs of the inflated shell, beside the step predicted.

The shell is inflated and its cover held, so that nothing moves but what the scheme itself makes grow. Two copies of it, one
disturbed by a hair, take the same steps; a step is stable if their distance has not grown.
"""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product
from math import sqrt
from pathlib import Path
from typing import NamedTuple
