from sid import provenance


def test_another_version_of_a_library_is_another_fingerprint(monkeypatch):
    provenance.fingerprint.cache_clear()
    before = provenance.fingerprint("sid.geometry.fem"), provenance.fingerprint("sid.errors")
    provenance.fingerprint.cache_clear()
    monkeypatch.setattr(provenance, "_version", lambda library: "999")
    after = provenance.fingerprint("sid.geometry.fem"), provenance.fingerprint("sid.errors")
    provenance.fingerprint.cache_clear()
    assert before[0] != after[0] and before[1] == after[1]  # the second one uses no library


def test_the_libraries_of_a_module_are_those_that_it_imports():
    of_fem = provenance._with_imports(("sid.geometry.fem",))
    assert {"numpy", "scipy"} <= provenance._libraries("sid.geometry.fem")
    assert "sid.geometry.delaunay" in of_fem and "igl" in provenance._libraries("sid.geometry.delaunay")
    assert all(provenance._version(library) for name in of_fem for library in provenance._libraries(name))
