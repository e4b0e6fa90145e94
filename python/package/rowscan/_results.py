"""Results: dicts as the command line writes them in JSON, with their keys as attributes, and as data frames.

A result is a dict: what read `found["lai"]` goes on reading it. `found.lai` is the same, and `found.trees[0].height_m`. Nothing is measured here.
"""

from typing import Any, Dict, List, Optional


class Result(Dict[str, Any]):
    """A dict whose keys are attributes. Dicts below it are, too."""

    def __getattr__(self, name: str) -> Any:
        try:
            return self[name]
        except KeyError:
            raise AttributeError("%s has no %r; it has %s" % (type(self).__name__, name, ", ".join(self))) from None

    def __dir__(self) -> List[str]:
        return [*super().__dir__(), *self]

    def to_dict(self) -> Dict[str, Any]:
        """Plain dicts and lists, as `json.loads` gives them."""
        return {key: _plain(value) for key, value in self.items()}

    def __reduce__(self) -> Any:
        return type(self), (self.to_dict(),)


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _plain(inner) for key, inner in value.items()}
    return [_plain(inner) for inner in value] if isinstance(value, list) else value


def _wrapped(value: Any) -> Any:
    if isinstance(value, dict):
        return Result({key: _wrapped(inner) for key, inner in value.items()})
    return [_wrapped(inner) for inner in value] if isinstance(value, list) else value


def _frame(rows: List[Dict[str, Any]]) -> Any:
    import pandas

    return pandas.DataFrame([_plain(row) for row in rows])


class Estimate(Result):
    """What a stream of scans says about a row; `rowscan estimate --format json`. What is not known is None."""

    scans: int
    scans_lost: int
    impacted_total_area_m2: Optional[float]
    leaf_area_m2: Optional[float]
    leaf_area_interval_m2: Optional[List[float]]
    leaf_area_contact_m2: Optional[float]
    leaf_area_withheld: Optional[str]
    lai: Optional[float]
    trees: List[Result]
    slices: List[Result]
    warnings: List[str]

    def __init__(self, document: Dict[str, Any]) -> None:
        super().__init__({key: _wrapped(value) for key, value in document.items()})

    def to_frame(self, of: str = "trees") -> Any:
        """A pandas data frame, a row a tree; of="slices" a row a metre, of="side_by_side" a row an estimator, of="profile" a row a band of height of the row."""
        if of not in ("trees", "slices", "side_by_side", "profile"):
            raise ValueError("of: expected `trees`, `slices`, `side_by_side` or `profile`, found `%s`" % of)
        if of == "profile":
            return _frame(self.get("profile", {}).get("row", []))
        return _frame(self.get(of, []))

    def bands(self, tree: Optional[int] = None) -> Dict[str, List[Any]]:
        """The profile's bands as lists by key, from the ground up, of the row or of one tree: what NumPy takes as it is. What is not known is NaN; an interval is
        a pair. Trees and row have the same bands. Empty without `profile`."""
        profile = self.get("profile", {})
        if tree is None:
            bands = profile.get("row", [])
        else:
            found = [told["bands"] for told in profile.get("trees", []) if told["tree"] == tree]
            if not found:
                raise KeyError("the profile has no tree %s" % tree)
            bands = found[0]
        nan = float("nan")
        unknown = lambda key: [nan, nan] if key.endswith(("interval_m2", "error_m2")) else nan  # noqa: E731
        keys = list(bands[0]) if bands else []
        return {key: [unknown(key) if band[key] is None else _plain(band[key]) for band in bands] for key in keys}


class StudyReport(Result):
    """The report of a study; `rowscan study run --format json`. A notebook shows its figure."""

    rows: List[Result]
    effects: List[Result]

    def __init__(self, document: Dict[str, Any], svg: str = "") -> None:
        super().__init__({key: _wrapped(value) for key, value in document.items()})
        # No key of the document.
        self.__dict__["svg"] = svg

    svg: str

    def to_frame(self, of: str = "rows") -> Any:
        """A pandas data frame, a row a point and orchard; of="effects" a row a value of an axis and an output."""
        if of not in ("rows", "effects"):
            raise ValueError("of: expected `rows` or `effects`, found `%s`" % of)
        return _frame(self[of])

    def _repr_svg_(self) -> str:
        return self.svg

    def __reduce__(self) -> Any:
        return type(self), (self.to_dict(), self.svg)
