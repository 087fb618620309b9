"""Mesh files in, meshes and marks out; nothing else in the package knows a file format.

- `mesh_file`: the door. `read_mesh(path)` gives vertices and triangles, `read_mesh_file(path)` these and
what is
  to be said about them, `read_mesh_bytes(content)` the same without a file.
- `ply`, `obj`, `off`, `stl`, `gltf`, `vtk_legacy`, `vtk_xml`, `mat`: one reader for each format, from bytes.
- `polygons`, `cells`, `grids`: triangles of polygons and strips, of the cells of VTK, of structured grids.
- `text`, `limits`: lines and numbers of text files; how much memory a file may ask for.
- `mesh_data`: what a reader returns.
- `export`: from arrays to bytes, one writer for each format.
"""
