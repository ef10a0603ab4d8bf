// Reads what a GLB says its vertices belong to (EXT_mesh_features, EXT_structural_metadata) with a reader that other
// people wrote: loaders.gl.

import assert from 'node:assert/strict';
import { parse } from '@loaders.gl/core';
import { GLTFLoader } from '@loaders.gl/gltf';

/** The property tables by name, as lists of rows, and how many vertices belong to each row, by its id. */
export async function semantics(bytes) {
  const buffer = bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length);
  const { json } = await parse(buffer, GLTFLoader, { gltf: { loadImages: false } });
  const tables = json.extensions.EXT_structural_metadata.propertyTables.map((table) => ({
    name: table.name,
    rows: Array.from({ length: table.count }, (_, row) => ({
      id: table.properties.id.data[row],
      name: table.properties.name.data[row],
      color: [...table.properties.color.data.slice(3 * row, 3 * row + 3)],
      points: table.properties.points?.data[row],
      area: table.properties.area?.data[row],
      confidence: table.properties.confidence?.data[row],
      vertices: 0,
    })),
  }));
  for (const primitive of primitives(json)) {
    for (const set of primitive.extensions.EXT_mesh_features.featureIds) {
      const { rows } = tables[set.propertyTable];
      const counted = new Set();
      for (const id of set.data) {
        if (id === set.nullFeatureId) continue;
        assert.ok(rows[id], `feature ${id} of ${set.label}: no such row`);
        rows[id].vertices += 1;
        counted.add(id);
      }
      assert.equal(counted.size, set.featureCount, `features of ${set.label}`);
    }
  }
  return Object.fromEntries(tables.map(({ name, rows }) => [name, rows]));
}

/** The primitives of the scene: there is one. */
function primitives(json) {
  assert.equal(json.scenes.length, 1);
  const [root] = json.scenes[json.scene].nodes;
  return (json.nodes[root].children ?? []).flatMap((node) => json.meshes[json.nodes[node].mesh].primitives);
}
