// Reads the vertices of `cloud.ply` and `mesh.ply` (binary little endian) as a stranger would: from the header alone.

import assert from 'node:assert/strict';

const READ = {
  float32: [4, (bytes, at) => bytes.readFloatLE(at)],
  uint8: [1, (bytes, at) => bytes.readUInt8(at)],
  uint16: [2, (bytes, at) => bytes.readUInt16LE(at)],
};

/** Header and vertices of a point cloud or a mesh; a mesh's faces lie behind the vertices in `body`. */
export class Ply {
  constructor(bytes) {
    const end = bytes.indexOf('end_header\n');
    assert.ok(end > 0, 'no PLY header');
    const lines = bytes.subarray(0, end).toString('utf8').split('\n').map((line) => line.trim());
    assert.equal(lines[0], 'ply');
    assert.equal(lines[1], 'format binary_little_endian 1.0');
    this.count = Number(lines.find((line) => line.startsWith('element vertex '))?.split(' ')[2]);
    /** Columns as `{name, type, offset}`. */
    this.properties = [];
    this.stride = 0;
    const faces = lines.findIndex((line) => line.startsWith('element face '));
    const ofVertices = faces < 0 ? lines : lines.slice(0, faces);
    for (const line of ofVertices.filter((line) => line.startsWith('property '))) {
      const [, type, name] = line.split(' ');
      assert.ok(type in READ, `type of ${name}: ${type}`);
      this.properties.push({ name, type, offset: this.stride });
      this.stride += READ[type][0];
    }
    /** Component classes as `{id, name, color: [r, g, b]}`. */
    this.classes = lines.flatMap((line) => {
      const found = line.match(/^comment label (\d+) (.+) #([0-9a-f]{6})$/i);
      return found ? [{ id: Number(found[1]), name: found[2], color: [...Buffer.from(found[3], 'hex')] }] : [];
    });
    this.body = bytes.subarray(end + 'end_header\n'.length);
  }

  /** All values of a column. */
  column(name) {
    const property = this.properties.find((property) => property.name === name);
    assert.ok(property, `no property ${name}`);
    const read = READ[property.type][1];
    return Array.from({ length: this.count }, (_, i) => read(this.body, i * this.stride + property.offset));
  }
}
