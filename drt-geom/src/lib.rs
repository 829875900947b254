//! Triangle meshes, topology, watertight f64 ray queries and procedural shapes
