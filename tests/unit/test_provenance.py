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
    assert {"numpy", "scipy", "igl"} <= provenance._libraries("sid.geometry.fem")
    assert all(provenance._version(library) for library in provenance._libraries("sid.geometry.fem"))
