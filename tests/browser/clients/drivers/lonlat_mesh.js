// Height of a mesh at a place, for clients without a ray of their own: the triangle that holds it in longitude and latitude.

// vertices: [lon, lat, height, …]; triangles: three indices each. Null where no triangle holds the place.
export function height_in({ vertices, triangles }, { lon, lat }) {
  for (let i = 0; i < triangles.length; i += 3) {
    const [a, b, c] = [0, 1, 2].map((k) => 3 * triangles[i + k]);
    const [ax, ay] = [vertices[a] - lon, vertices[a + 1] - lat];
    const [bx, by] = [vertices[b] - lon, vertices[b + 1] - lat];
    const [cx, cy] = [vertices[c] - lon, vertices[c + 1] - lat];
    const [u, v, w] = [bx * cy - cx * by, cx * ay - ax * cy, ax * by - bx * ay];
    const area = u + v + w;
    if (area === 0 || u / area < -1e-9 || v / area < -1e-9 || w / area < -1e-9) continue;
    return (u * vertices[a + 2] + v * vertices[b + 2] + w * vertices[c + 2]) / area;
  }
  return null;
}

// The highest of several meshes: skirts hang below the surface.
export function highest_in(meshes, place) {
  const found = meshes.map((mesh) => height_in(mesh, place)).filter((height) => height !== null);
  return found.length > 0 ? Math.max(...found) : null;
}
