"""Records of drop tests: files of measured channels, read into and written from one form."""

from softbrake.signals.channel import QUANTITIES, Channel, SignalError
from softbrake.signals.read import read_channels

__all__ = ["QUANTITIES", "Channel", "SignalError", "read_channels"]
