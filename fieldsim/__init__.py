"""fieldsim: convolution fields that pull, collide and are seen."""
