// A session by the client that hey-api generates: hey.mjs URL MESH
import fs from 'node:fs';
import { createMesh, executeEncode, executeGeodesic, followJob, getJob, getResults, getSurfaceMesh } from './hey/sdk.gen.js';
import { client } from './hey/client.gen.js';

const [url, file] = process.argv.slice(2) as [string, string];
client.setConfig({ baseUrl: url });

const mesh = await createMesh({
    body: new Blob([fs.readFileSync(file)]),
    bodySerializer: null,
    headers: { 'Content-Type': 'application/octet-stream' },
    throwOnError: true,
});
const started = await executeEncode({
    headers: { Prefer: 'respond-async' },
    body: { inputs: { mesh: mesh.data.id, lmax: 6 } },
    throwOnError: true,
});
if (!('jobID' in started.data)) {
    throw new Error('no job');
}
const id = started.data.jobID;
const events = await followJob({ path: { id }, parseAs: 'text', throwOnError: true });
if (!/^event: status$/m.test(String(events.data))) {
    throw new Error('no event');
}
const job = await getJob({ path: { id }, throwOnError: true });
const results = await getResults({ path: { id }, throwOnError: true });
const surface = (results.data as { surface: { id: string } }).surface.id;
const view = await getSurfaceMesh({ path: { id: surface }, query: { format: 'glb' }, parseAs: 'arrayBuffer', throwOnError: true });
const bytes = new Uint8Array(view.data as unknown as ArrayBuffer);
console.log(surface, new TextDecoder().decode(bytes.slice(0, 4)), job.data.progress);

export const attempts = [
    // @ts-expect-error: it is a number
    () => executeEncode({ body: { inputs: { mesh: 'mesh-', smoothing: 'much' } } }),
    // @ts-expect-error: the other end must be given
    () => executeGeodesic({ body: { inputs: { from: 'surf-' } } }),
];
