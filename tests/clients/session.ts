// A session by openapi-fetch with the types of openapi-typescript: session.js URL MESH
import fs from 'node:fs';
import createClient from 'openapi-fetch';
import type { components, paths } from './api.js';

const [url, file] = process.argv.slice(2) as [string, string];
const client = createClient<paths>({ baseUrl: url });

function must<T>(value: T | undefined, what: string): T {
    if (value === undefined) {
        throw new Error(what);
    }
    return value;
}

const mesh = await client.POST('/v1/meshes', {
    body: new Blob([fs.readFileSync(file)]),
    bodySerializer: (body) => body,
    headers: { 'Content-Type': 'application/octet-stream' },
});
const id: string = must(mesh.data, 'no mesh').id;

// The path selects the types: inputs that have defaults may be left out.
const started = await client.POST('/v1/processes/encode/execution', {
    params: { header: { Prefer: 'respond-async' } },
    body: { inputs: { mesh: id, lmax: 6 } },
});
let job = must(started.data, 'no job') as components['schemas']['Job'];

// Its events, by a streamed body.
const events = await client.GET('/v1/jobs/{id}/events', {
    params: { path: { id: job.jobID } },
    parseAs: 'stream',
});
let told = '';
for await (const piece of must(events.data ?? undefined, 'no events') as unknown as AsyncIterable<Uint8Array>) {
    told += new TextDecoder().decode(piece);
}
if (!/^event: status$/m.test(told)) {
    throw new Error('no event');
}
job = must((await client.GET('/v1/jobs/{id}', { params: { path: { id: job.jobID } } })).data, 'no job');
if (job.status !== 'successful') {
    throw new Error(job.message);
}

const encoded = await client.POST('/v1/processes/encode/execution', { body: { inputs: { mesh: id, lmax: 6 } } });
const results = must(encoded.data, 'no results');
if (!('surface' in results) || !results.surface) {
    throw new Error('no surface');
}
const surface: string = results.surface.id;
const view = await client.GET('/v1/surfaces/{id}/mesh', {
    params: { path: { id: surface }, query: { format: 'glb' } },
    parseAs: 'arrayBuffer',
});
const bytes = must(view.data, 'no mesh of the surface');
console.log(surface, new TextDecoder().decode(new Uint8Array(bytes).slice(0, 4)), job.progress);
