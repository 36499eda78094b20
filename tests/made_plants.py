"""Plants whose best motions are known by heart."""

from workbench.plant.assembly import Assembly


def carriage():
    """x'' = u, the double integrator."""
    b = Assembly("carriage", {})
    x, v = b.state("x", "m", 1.0), b.state("v", "m/s", 1.0)
    command = b.input("command", "1", 1.0)
    b.rate("x", v)
    b.rate("v", command)
    b.output(position=x)
    return b.finish()
