"""What effects are to each other in a search: which can be together, which are alike, and which are usual.

Each class says its part (`AbstractEffect.same_as`, `excludes`, `contains`, `relatives`); what one says of another
holds both ways.
"""

from collections.abc import Collection, Iterable, Mapping

from jaxmotor.motor.effects import AbstractEffect, AbstractLearnedEffect, AbstractLoadEffect, free_size

PRICE, MORE, RARE = 1.5, 0.75, 0.75
"""Of an effect with one parameter, of each parameter more, and of effects that are rare, in logarithms of
probability."""
COUNTED = 4
"""Parameters that are paid for: what a curve's further freedom costs, blocks left out show."""

Kind = type[AbstractEffect]
Group = tuple[str, ...]


class Relations:
    """Of the effects that are `known`, by name, and of which some are `asked` for; all where None."""

    def __init__(self, known: Mapping[str, Kind], asked: Collection[str] | None = None):
        self.known, self.asked = known, known if asked is None else asked
        self.alike = groups(known.values())
        tried = [effect for effect in known.values() if effect.always_tried]
        self.always = tuple(effect.name for effect in sorted(tried, key=lambda effect: effect.rarity))
        """Effects that are fitted beside the linear motor whatever their scores, the usual ones first."""

    def price(self, name: str) -> float:
        """Of an effect, in logarithms of probability."""
        return price_of(self.known[name])

    def simpler(self, name: str) -> tuple[str, ...]:
        """The special cases of an effect."""
        return tuple(simple for simple in self.known[name].contains if simple in self.known)

    def is_simpler(self, effect: AbstractEffect) -> bool:
        """With its parameters `effect` is one of its special cases, which is asked for."""
        return effect.is_special and any(simple in self.asked for simple in self.simpler(effect.name))

    def containing(self, name: str) -> set[str]:
        """Known laws of which an effect is a special case: where one is there, so is that. Curves have no name."""
        laws = (other for other in self.known if not issubclass(self.known[other], AbstractLearnedEffect))
        return {other for other in laws if name in self.simpler(other)}

    def curves(self, name: str) -> set[str]:
        """Known learned curves of which an effect is a special case."""
        learned = (other for other in self.known if issubclass(self.known[other], AbstractLearnedEffect))
        return {other for other in learned if name in self.simpler(other)}

    def over_same(self, curve: str) -> set[str]:
        """Known laws over the coordinate of a learned `curve`, which its shape may be made of."""
        over = self.known[curve].over
        return {*self.simpler(curve), *(name for name in self.known if over and self.known[name].over == over)}

    def is_rare(self, name: str) -> bool:
        """An effect is sought only where the usual ones leave something."""
        return self.known[name].sought_last

    def relatives(self, name: str) -> Group:
        """The effects that are alike, with the effect itself; none where it is alone."""
        return next((group for group in self.alike if name in group), ())

    def sharing(self, name: str) -> Group:
        """The effects that may do a part of what an effect does: those that are alike, or are like its special cases.
        Laws that are sought last, and what is the log's, share with none."""
        special = self.simpler(name) if name in self.known and not self.known[name].sought_last else ()
        return tuple(
            dict.fromkeys((*self.relatives(name), *(near for simple in special for near in self.relatives(simple))))
        )

    def families(self) -> dict[str, Group]:
        """The effects of each family (`AbstractEffect.family`)."""
        of = {name: effect.family for name, effect in self.known.items() if effect.family}
        return {family: tuple(name for name in of if of[name] == family) for family in dict.fromkeys(of.values())}

    def barred(self, effects: Iterable[AbstractEffect]) -> set[str]:
        """Effects that cannot be in a motor with `effects`."""
        own = [type(effect) for effect in effects]
        return {name for name, other in self.known.items() if any(excluded(one, other) for one in own)}

    def one_name(self, names: Iterable[str]) -> frozenset[str]:
        """`names` of effects, each law by the first one that it has."""
        return frozenset(next((one for one in self.known if self._same(one, name)), name) for name in names)

    def _same(self, one: str, other: str) -> bool:
        return one == other or (other in self.known and is_same(self.known[one], self.known[other]))

    def is_told(self, name: str, others: Iterable[str]) -> bool:
        """One of `others` is the same law as the effect `name`."""
        return any(is_same(self.known[name], self.known[other]) for other in others)


def price_of(effect: Kind) -> float:
    """In logarithms of probability."""
    return PRICE + MORE * (min(free_size(effect), COUNTED) - 1) + RARE * effect.rarity


def excluded(one: Kind, other: Kind) -> bool:
    """The two cannot be in one motor."""
    loads = issubclass(one, AbstractLoadEffect) and issubclass(other, AbstractLoadEffect)
    contained = one.name in other.contains or other.name in one.contains
    stated = one.name in other.excludes or other.name in one.excludes
    return one is other or loads or contained or stated or is_same(one, other)


def is_same(one: Kind, other: Kind) -> bool:
    """The two are one law by two names."""
    return one.name in other.same_as or other.name in one.same_as


def groups(effects: Iterable[Kind]) -> tuple[Group, ...]:
    """Names of effects that are alike, in the order in which they are stated; no name is in two groups."""
    found: list[Group] = []
    for effect in effects:
        if effect.relatives:
            own = (effect.name, *effect.relatives)
            near = [group for group in found if set(group) & set(own)]
            joined = tuple(dict.fromkeys(name for group in (*near, own) for name in group))
            found = [*(group for group in found if group not in near), joined]
    return tuple(found)
