// A session by swagger-client: swagger.mjs URL MESH
import fs from 'node:fs';
import SwaggerClient from 'swagger-client';

const [url, file] = process.argv.slice(2);
const client = await SwaggerClient({ url: url + '/v1/openapi.json' });
const { meshes, processes, jobs, surfaces } = client.apis;
const uploaded = await meshes.createMesh(
    { format: 'ply' },
    { requestBody: fs.readFileSync(file), requestContentType: 'application/octet-stream' }
);
const body = { inputs: { mesh: uploaded.body.id, lmax: 6 } };
const started = await processes.executeEncode({ Prefer: 'respond-async' }, { requestBody: body });
const id = started.body.jobID;
const events = await jobs.followJob({ id });
if (!/^event: status$/m.test(events.text)) {
    throw new Error('no event');
}
const job = await jobs.getJob({ id });
const results = await jobs.getResults({ id });
const view = await surfaces.getSurfaceMesh({ id: results.body.surface.id, format: 'glb' });
const bytes = Buffer.from(await view.data.arrayBuffer());
console.log(results.body.surface.id, bytes.toString('latin1', 0, 4), job.body.progress);
