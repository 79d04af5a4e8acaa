"""Hash-consed scalar expression graph: nodes, operations, differentiation, evaluation; it knows no mechanism."""
