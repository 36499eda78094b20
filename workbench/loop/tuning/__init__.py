"""The search for a controller's numbers.

problem    the numbers that are searched, and a controller with them
goals      hard goals in their order, then the cost
search     designs in parts, tried by evolution, and between them harder plants to judge them on
"""
