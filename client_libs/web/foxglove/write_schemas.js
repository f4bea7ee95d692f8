// Writes the JSON schemas of the messages that the gateway sends to Foxglove to a folder, from which
// the gateway embeds them.
import schemas from '@foxglove/schemas/jsonschema.js';
import { mkdirSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { argv } from 'node:process';

const folder = argv[2] ?? 'schemas';
mkdirSync(folder, { recursive: true });
for (const schema of [schemas.FrameTransforms, schemas.Grid, schemas.SceneUpdate]) {
  writeFileSync(join(folder, `${schema.title}.json`), JSON.stringify(schema));
}
