"""Scenarios as data: each is an entry that this makes, and a function that does it."""
import dataclasses
import typing

ALL = {}


@dataclasses.dataclass
class Scenario:
    name: str
    point: int  # of the list in docs/hostile.md
    what: str  # what the attacker does
    run: typing.Callable


def scenario(name, point, what):
    """Adds the function below to the table."""
    def add(run):
        assert name not in ALL, name
        ALL[name] = Scenario(name, point, what, run)
        return run
    return add
