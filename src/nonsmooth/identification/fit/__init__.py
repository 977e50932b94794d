"""Parameters of any system from recordings: multiple shooting with exact derivatives through transitions."""
