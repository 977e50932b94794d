"""The statements of the paper: measured on the datasets of the figures, and judged."""
