"""The report of a reproduction, as Markdown and as a page."""
