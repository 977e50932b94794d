"""Recordings: what a lab records, as labelled arrays with units, rates and their origin in the file."""

from nonsmooth.recordings.load import load_recording
from nonsmooth.recordings.recording import Recording, RecordingWarning
from nonsmooth.recordings.session import PROCEDURES, SETTINGS, Quantity, Session, load_session

__all__ = [
    "PROCEDURES",
    "SETTINGS",
    "Quantity",
    "Recording",
    "RecordingWarning",
    "Session",
    "load_recording",
    "load_session",
]
