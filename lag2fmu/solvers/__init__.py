"""The methods of co-simulation as data: coefficients that prove their own order, and what each method needs."""
