"""The command line: reads arguments and study files, calls the package, prints. No numerics here."""
