"""The experiment: what a lab records, as labelled arrays with units, rates and their origin in the file."""

from nonsmooth.experiment.capstone_writers import write_cap, write_capstone_csv
from nonsmooth.experiment.load import load_recording
from nonsmooth.experiment.recording import Recording, RecordingWarning

__all__ = ["Recording", "RecordingWarning", "load_recording", "write_cap", "write_capstone_csv"]
