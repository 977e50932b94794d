"""Numbers read off results: each quantity by its name, tables, regions that fulfil a condition."""
