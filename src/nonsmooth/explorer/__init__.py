"""The explorer: a local web page in which the diagrams of a system follow its parameters."""
