"""Figures of the model: one file computes and draws one group of them."""
