"""Mesh files in, meshes and marks out; nothing else in the package knows a file format.

- `mesh_file`: the door. `read_mesh(path)` gives vertices and triangles, `read_mesh_file(path)` these and
what is
  to be said about them, `read_mesh_bytes(content)` the same without a file.
- `ply`, `obj`, `off`, `stl`, `gltf`, `vtk_legacy`, `vtk_xml`, `mat`: one reader for each format, from bytes.
- `polygons`, `cells`, `grids`: triangles of polygons and strips, of the cells of VTK, of structured grids.
- `text`, `limits`: lines and numbers of text files; how much memory a file may ask for.
- `mesh_data`: what a reader returns.
- `export_ply`, `export_vtp`, `export_glb`: a mesh with its saliency and points, from arrays to bytes.
- `export_arrays`, `colours`: what these write, checked; saliency as colours.
- `landmarks`: MeshLab's `.pp` and 3D Slicer's `.mrk.json`, read and written.
"""
