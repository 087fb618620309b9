import subprocess
import sys
from pathlib import Path

import pytest

from sid import provenance


@pytest.fixture
def fingerprint(monkeypatch, tmp_path):
    """The function as in a new process, which keeps what it finds in a folder of its own."""

    def forget():
        for function in vars(provenance).values():
            getattr(function, "cache_clear", bool)()

    def anew(*modules):
        forget()
        return provenance.fingerprint(*modules)

    monkeypatch.setattr(provenance, "KEPT", tmp_path / "kept/provenance.json")
    yield anew
    monkeypatch.undo()
    forget()


def test_another_version_of_a_library_is_another_fingerprint(fingerprint, monkeypatch):
    before = fingerprint("sid.geometry.fem"), fingerprint("sid.errors")
    monkeypatch.setattr(provenance, "_version", lambda library: "999")
    after = fingerprint("sid.geometry.fem"), fingerprint("sid.errors")
    assert before[0] != after[0] and before[1] == after[1]  # the second one uses no library


def test_the_libraries_of_a_module_are_those_that_it_imports():
    of_fem = provenance._with_imports(("sid.geometry.fem",))
    assert {"numpy", "scipy"} <= provenance._libraries("sid.geometry.fem")
    assert "sid.geometry.delaunay" in of_fem and "igl" in provenance._libraries("sid.geometry.delaunay")
    assert all(provenance._version(library) for name in of_fem for library in provenance._libraries(name))


SOURCE = b"""
import numpy


def half(x):
    return x / 2
"""


@pytest.mark.parametrize(
    "edited",
    [
        SOURCE.replace(b"import numpy", b"# why\nimport numpy  # here"),
        b'"""What it does."""' + SOURCE,
        SOURCE.replace(b"return", b'"""Half of it."""\n    return'),
        SOURCE.replace(b"x / 2", b"(x\n            / 2)"),
    ],
)
def test_a_word_or_a_line_break_is_the_same_code(edited):
    assert provenance.parse(edited) == provenance.parse(SOURCE)


@pytest.mark.parametrize(
    "edited",
    [
        SOURCE.replace(b"/ 2", b"/ 3"),
        SOURCE.replace(b"/ 2", b"/ 2.0"),
        SOURCE.replace(b"numpy", b"scipy"),
        SOURCE.replace(b"return", b"print('half of it')\n    return"),
    ],
)
def test_a_real_edit_is_other_code(edited):
    assert provenance.parse(edited).code != provenance.parse(SOURCE).code


def test_imports_are_found_wherever_they_stand():
    source = b"""
def f():
    try:
        from sid.geometry import fem
    except ImportError:
        import scipy.sparse as s
    class A:
        if True:
            import igl
"""
    assert provenance.parse(source).imported == ["igl", "scipy.sparse", "sid.geometry", "sid.geometry.fem"]


def test_what_was_found_once_is_not_looked_for_again(fingerprint, monkeypatch):
    first = fingerprint("sid.geometry.fem")
    (kept,) = provenance.KEPT.parent.iterdir()  # in one piece, nothing beside it
    assert kept == provenance.KEPT
    monkeypatch.setattr(provenance, "parse", lambda source: pytest.fail("parsed again"))
    assert fingerprint("sid.geometry.fem") == first


def test_a_module_that_was_edited_is_looked_at_again(fingerprint, monkeypatch, tmp_path):
    package = tmp_path / "sid"
    package.mkdir()
    module = package / "some.py"
    module.write_bytes(SOURCE)
    maker = package / "provenance.py"
    maker.write_bytes(Path(provenance.__file__).read_bytes())
    monkeypatch.setattr(provenance, "__file__", str(maker))
    first = fingerprint("sid.some")
    module.write_bytes(SOURCE.replace(b"/ 2", b"/ 3"))  # as long as before, and perhaps in the same tick
    assert fingerprint("sid.some") != first
    module.write_bytes(SOURCE)
    assert fingerprint("sid.some") == first
    # and by another version of what looks at it, all of them are
    looks, true = [], provenance.parse
    monkeypatch.setattr(provenance, "parse", lambda source: looks.append(source) or true(source))
    maker.write_bytes(b"# another one")
    assert fingerprint("sid.some") == first and looks == [SOURCE]
    assert fingerprint("sid.some") == first and looks == [SOURCE]


@pytest.mark.parametrize("text", ["", "{", '{"sid.errors": ["'])
def test_a_file_that_lost_power_is_written_anew(fingerprint, text):
    first = fingerprint("sid.errors")
    whole = provenance.KEPT.read_text()
    provenance.KEPT.write_text(text)
    assert fingerprint("sid.errors") == first
    assert provenance.KEPT.read_text() == whole


def test_where_nothing_can_be_kept_the_fingerprint_is_the_same(fingerprint):
    first = fingerprint("sid.errors")
    provenance.KEPT.unlink()
    provenance.KEPT.parent.rmdir()
    provenance.KEPT.parent.write_text("no folder")
    assert fingerprint("sid.errors") == first


def test_another_process_finds_the_same():
    code = "from sid.provenance import fingerprint; print(fingerprint('sid.eigen.spectrum'))"
    run = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, cwd=Path(__file__).parents[2]
    )
    assert run.stdout.strip() == provenance.fingerprint("sid.eigen.spectrum"), run.stderr
