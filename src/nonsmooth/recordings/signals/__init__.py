"""From samples to what a theory speaks of: position and velocity, contacts, the drive's phase, section points, spectra.

One file per question; every result carries its errors. Arrays go in (or channels of a recording, whose names then stand
in the messages); small frozen objects or Datasets come out. Import from the files: ``signals.smoothing.smooth``.
"""
