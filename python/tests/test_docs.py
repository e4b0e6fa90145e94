"""The Python of docs/python.md and of the READMEs runs as it stands."""

import pathlib
import re
import shutil

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
DOCUMENTS = ["README.md", "docs/python.md", "python/README.md"]


def blocks():
    for document in DOCUMENTS:
        text = (ROOT / document).read_text(encoding="utf-8")
        for number, block in enumerate(re.findall(r"^```python\n(.*?)^```$", text, re.M | re.S)):
            yield pytest.param(block, id="%s-%d" % (document, number))


def test_every_document_has_some():
    assert {parameter.id.rsplit("-", 1)[0] for parameter in blocks()} == set(DOCUMENTS)


@pytest.mark.parametrize("block", blocks())
def test_a_block_runs(block, pytester):
    if "def test_" not in block:
        block = "def test_it():\n" + "".join("    " + line for line in block.splitlines(keepends=True))
    pytester.makepyfile(block)
    # The scenario that docs/bench.md begins with.
    bench = (ROOT / "docs" / "bench.md").read_text(encoding="utf-8")
    (pytester.path / "row.toml").write_text(re.search(r"^```toml\n(.*?)^```$", bench, re.M | re.S)[1], encoding="utf-8")
    shutil.copy(ROOT / "tools" / "scenarios" / "controller.py", pytester.path)
    pytester.runpytest_subprocess("-q").assert_outcomes(passed=block.count("def test_"))


def test_stubs_name_what_there_is():
    """The types for editors list the same names as the extension."""
    import ast

    import rowscan
    from rowscan import _native

    stubs = ast.parse((pathlib.Path(rowscan.__file__).parent / "_native.pyi").read_text(encoding="utf-8"))
    told = {node.name: node for node in stubs.body if isinstance(node, (ast.ClassDef, ast.FunctionDef))}
    # Results are Python, and carry their types themselves.
    ours = {"Estimate", "StudyReport", "__version__"}
    assert set(told) == set(rowscan.__all__) - ours
    assert set(told) == {name for name in vars(_native) if not name.startswith("_")}
    for name in ["Leaves", "Orchard", "RowScan", "ScanArrays", "Scanner"]:
        public = {member for member in vars(getattr(_native, name)) if not member.startswith("_")}
        fields = {node.target.id for node in told[name].body if isinstance(node, ast.AnnAssign)}
        listed = fields | {node.name for node in told[name].body if isinstance(node, ast.FunctionDef)}
        assert {member for member in listed if not member.startswith("_")} == public, name
