"""One file per format; what each ``read`` gives, ``assemble`` makes a ``Recording`` of."""
