// fuzz.cjs - requests drawn from an OpenAPI description, against the daemon that it describes.
//
//   node fuzz.cjs FOLDER-WITH-node_modules DESCRIPTION URL REQUESTS [SEED]
//
// Sends REQUESTS requests, one after the other, to every operation in turn: those that fit, and those of which
// one part is bent (requests.cjs), with identifiers of what is there, of what was, and of what never was. The same
// SEED draws the same requests, as far as what they name does not depend on how fast jobs end.
// Of each answer it holds:
//
//   - its status is documented for the operation, and is no 5xx, but for 503 with Retry-After where an execution
//     finds the queue full or the streams are all taken
//   - its media type is documented for that status, and a JSON body fits the schema of it; problems tell their status
//   - a request that the schemas refuse is refused: 4xx with a problem
//   - what is there is found: the record of something alive, asked for rightly, is 200
//   - what was deleted is not found any more: 404 until it is made again
//   - a method that the path does not have is 405, and Allow names those that it has
//
// It prints each violation with the request, and ends with 1 if there was one.
'use strict';

const fs = require('fs');
const http = require('http');
const path = require('path');
const { createRequire } = require('module');

const { load, documented } = require('./description.cjs');
const { makeValues } = require('./values.cjs');
const { makeRequests } = require('./requests.cjs');
const samples = require('./samples.cjs');

const [modulesFolder, file, base, countText, seedText] = process.argv.slice(2);
const modules = createRequire(path.resolve(modulesFolder, 'package.json'));
const fc = modules('fast-check');
const seed = Number(seedText || Date.now() % 0x7fffffff);
const total = Number(countText);
const ANSWER_MS = 60000; // an answer that takes longer is a violation
const STREAM_MS = 50; // a stream of events is left after this
const ALIVE_MAX = 60; // identifiers kept of each kind
const VIOLATIONS_MAX = 20;

const description = load(modules, fs.readFileSync(file, 'utf8'));
const agent = new http.Agent({ keepAlive: true, maxSockets: 1 });
const alive = { mesh: [], surf: [], model: [], job: [], cohort: [] };
const deleted = { job: [], cohort: [] };
const counts = { sent: 0, bent: 0, statuses: {}, operations: {} };
let violations = 0;
let lastEtag = null;

// ---- Sending -----------------------------------------------------------------------------------------------

function send(request) {
    const headers = { ...request.headers };
    if (request.body) {
        headers['Content-Length'] = request.body.length;
    }
    if (request.type) {
        headers['Content-Type'] = request.type;
    }
    return new Promise((done) => {
        const chunks = [];
        const sent = http.request(base + '/', { agent, method: request.method, path: request.path, headers }, (answer) => {
            const type = (answer.headers['content-type'] || '').toLowerCase();
            const finish = () =>
                done({ status: answer.statusCode, headers: answer.headers, type, body: Buffer.concat(chunks) });
            if (type.startsWith('text/event-stream')) {
                setTimeout(() => sent.destroy(), STREAM_MS);
            }
            answer.on('data', (chunk) => chunks.push(chunk));
            answer.on('close', finish);
        });
        sent.setTimeout(ANSWER_MS, () => sent.destroy(new Error(`no answer in ${ANSWER_MS} ms`)));
        sent.on('error', (error) => done({ status: 0, error, headers: {}, type: '', body: Buffer.alloc(0) }));
        sent.end(request.body || undefined);
    });
}

function report(request, answer, what) {
    violations++;
    if (violations > VIOLATIONS_MAX) {
        return;
    }
    const body = request.body ? ` ${request.type} ${JSON.stringify(request.body.toString('latin1').slice(0, 400))}` : '';
    console.log(`violation: ${what}`);
    console.log(`    request ${counts.sent}: ${request.method} ${request.path.slice(0, 300)}${body}`);
    console.log(`    headers: ${JSON.stringify(request.headers)}`);
    console.log(`    answer: ${answer.status} ${answer.type} ${JSON.stringify(answer.body.toString().slice(0, 500))}`);
}

// ---- Judging -----------------------------------------------------------------------------------------------

function parsed(answer) {
    try {
        return JSON.parse(answer.body.toString());
    } catch {
        return undefined;
    }
}

// The documented media type that an answer is of.
function mediaOf(content, type) {
    const spaced = (text) => text.replace(/\s*;\s*/g, '; ');
    const plain = spaced(type);
    const names = Object.keys(content);
    return names.find((name) => spaced(name) === plain) || names.find((name) => name === plain.split(';')[0]) ||
        names.find((name) => name === '*/*');
}

// Results may have any form, as they were asked for. Those that an execution did not ask to have framed are plain, and
// what the process describes.
function plainSchema(request, answer) {
    const { operation, values, body, type } = request;
    if (operation.id !== 'execute' || answer.status !== 200 || !type.startsWith('application/json')) {
        return null;
    }
    const { response, outputs } = parsed({ body }) || {};
    return response || outputs ? null : description.schemas[`${values.id}Outputs`];
}

function faultOfContent(request, answer) {
    const { operation } = request;
    const content = documented(operation, answer.status);
    const names = Object.keys(content);
    if (names.length === 0 || answer.status === 304) {
        return answer.body.length ? 'a body where none is documented' : null;
    }
    const media = mediaOf(content, answer.type);
    if (!media) {
        return `media type ${answer.type} is not documented for ${answer.status}`;
    }
    if (!media.endsWith('json')) {
        return null;
    }
    const value = parsed(answer);
    if (value === undefined) {
        return 'the body is not JSON';
    }
    const reason = description.fault(plainSchema(request, answer) || content[media], value);
    if (reason) {
        return `the body does not fit its schema: ${reason}`;
    }
    return media === 'application/problem+json' && value.status !== answer.status ? 'the problem has another status' : null;
}

const MAY_BE_BUSY = { execute: ['queue-full'], followJob: ['server-busy'] };

function faultOfStatus(operation, answer) {
    if (answer.status === 0) {
        return answer.error.message;
    }
    if (!documented(operation, answer.status)) {
        return `status ${answer.status} is not documented`;
    }
    if (answer.status >= 500) {
        const codes = MAY_BE_BUSY[operation.id] || [];
        const busy = answer.status === 503 && answer.headers['retry-after'] && codes.includes((parsed(answer) || {}).code);
        return busy ? null : `status ${answer.status}`;
    }
    return null;
}

const KINDS = { getMesh: 'mesh', getMeshContent: 'mesh', getSurface: 'surf', getModel: 'model', getJob: 'job', getCohort: 'cohort' };

function faultOfMemory(request, answer) {
    const { operation, values } = request;
    const id = values.id || values.name;
    const kind = KINDS[operation.id];
    if (kind && values.owner === undefined && alive[kind].includes(id) && ![200, 304, 406].includes(answer.status)) {
        return `${id} is there, and is not found`;
    }
    const gone = deleted.job.includes(id) || (operation.path.includes('{name}') && deleted.cohort.includes(id));
    if (gone && answer.status < 400) {
        return `${id} was deleted, and is found`;
    }
    return null;
}

function judge(request, answer) {
    const { operation, wrong } = request;
    let what = faultOfStatus(operation, answer) || faultOfContent(request, answer);
    if (!what && wrong.length && (answer.status < 400 || answer.status >= 500)) {
        what = `taken though it does not fit: ${wrong.join('; ')}`;
    }
    what = what || (wrong.length ? null : faultOfMemory(request, answer));
    if (what) {
        report(request, answer, `${operation.id}: ${what}`);
    }
}

// ---- Remembering -------------------------------------------------------------------------------------------

function keep(kind, id) {
    if (typeof id === 'string' && !alive[kind].includes(id) && alive[kind].length < ALIVE_MAX) {
        alive[kind].push(id);
    }
}

function bury(kind, id) {
    alive[kind] = alive[kind].filter((one) => one !== id);
    if (!deleted[kind].includes(id)) {
        deleted[kind].push(id);
    }
}

// A deletion says how many of each kind have gone. Which of the others it does not say: what is left of them is
// met again.
const COUNTED = { mesh: 'mesh', surface: 'surf', model: 'model', job: 'job', cohort: 'cohort' };

function forget(id, counts) {
    for (const kind of Object.keys(alive)) {
        alive[kind] = alive[kind].filter((one) => one !== id);
    }
    for (const [, word, count] of (counts || '').matchAll(/(\w+)=(\d+)/g)) {
        const kind = COUNTED[word];
        if (kind && Number(count) > (id.startsWith(`${kind}-`) ? 1 : 0)) {
            alive[kind] = [];
        }
    }
}

// Identifiers in an answer, wherever the service tells them. What is the user's own text may look like one.
const TEXTS = ['name', 'tags', 'label', 'labels', 'subject', 'subjects', 'groups', 'covariates'];
// What a model was made of by its content, which nobody keeps where it was encoded from a mesh.
const UNKEPT = ['contents'];

function harvest(value) {
    if (typeof value === 'string') {
        const match = /^(mesh|surf|model)-[0-9a-f]{32}$/.exec(value);
        return match ? keep(match[1], value) : undefined;
    }
    for (const [name, part] of value && typeof value === 'object' ? Object.entries(value) : []) {
        if (!TEXTS.includes(name) && !UNKEPT.includes(name)) {
            harvest(part);
        }
    }
    return undefined;
}

async function remember(request, answer) {
    const { operation } = request;
    const value = answer.type.startsWith('application/json') ? parsed(answer) : undefined;
    lastEtag = answer.headers.etag || lastEtag;
    if (answer.status === 200 && operation.id === 'deleteJob') {
        await rememberDeletion(request.values.id);
    } else if (answer.status === 204 && operation.id === 'deleteCohort') {
        bury('cohort', request.values.name);
    } else if (answer.status === 204 && /^delete(Mesh|Surface|Model|Volume)$/.test(operation.id)) {
        forget(request.values.id, answer.headers['srnfd-deleted']);
    } else if (operation.id === 'createCohort' && value && answer.status < 300) {
        rememberCohort(value.name);
    } else if (operation.id === 'changeCohort' && value && answer.status === 200) {
        if (value.name !== request.values.name) {
            bury('cohort', request.values.name);
        }
        rememberCohort(value.name);
    } else if (/^(create|get)(Mesh|Surface|Model|Results)$|^execute$/.test(operation.id) && answer.status < 300) {
        harvest(value);
    }
    if (operation.id === 'execute') {
        await rememberJob(answer);
    }
}

function rememberCohort(name) {
    deleted.cohort = deleted.cohort.filter((one) => one !== name);
    keep('cohort', name);
}

// DELETE dismisses a job that has not ended, and removes one that has.
async function rememberDeletion(id) {
    alive.job = alive.job.filter((one) => one !== id);
    if ((await send({ method: 'GET', path: `/v1/jobs/${id}`, headers: {}, body: null })).status === 404) {
        bury('job', id);
    }
}

// Jobs are cancelled at once but for a few, so that what is drawn does not compute for hours.
async function rememberJob(answer) {
    const match = /(job-[0-9a-f-]{36})/.exec(answer.headers.link || answer.headers.location || '');
    if (!match) {
        return;
    }
    keep('job', match[1]);
    if (answer.status === 201 && counts.sent % 4 !== 0) {
        await send({ method: 'POST', path: `/v1/jobs/${match[1]}/cancel`, headers: {}, body: null });
    }
}

// ---- Drawing -----------------------------------------------------------------------------------------------

function cohortSamples() {
    const members = [...alive.surf.slice(0, 4)].map((id, i) => ({ id, label: i % 2 ? 'a' : 'b', covariates: { age: i } }));
    return ['one', 'two', 'three'].map((name) => ({ name, members: members.length ? members : [{ id: 'x' }] }));
}

const pool = (kind) => [...alive[kind], ...(deleted[kind] || []).slice(-10)];
const values = makeValues(fc, description.resolve, pool);
const requests = makeRequests(fc, description, values, {
    meshes: samples.meshes,
    npy: samples.npy,
    json: { createSurface: () => samples.surfaces, createCohort: cohortSamples },
    etag: () => lastEtag,
    prefer: (g, text) => g(() => fc.constantFrom('respond-async', 'respond-async', 'respond-async', 'respond-async, wait=0', 'respond-async;x', 'wait=0', text)),
});

// Executions have as many inputs as all the rest, and give the other operations something to find.
const EXECUTION_TURNS = 12;
const turns = description.operations.flatMap((operation, i) =>
    i % 3 === 0 && i < 3 * EXECUTION_TURNS
        ? [operation, description.operations.find((other) => other.id === 'execute')]
        : [operation]
);

function generator(index) {
    return fc.sample(fc.gen(), { seed: seed + index, numRuns: 1 })[0];
}

// Names of cohorts are the user's: drawn from those that are or were there.
function nameCohort(g, request) {
    const names = pool('cohort');
    if (request.operation.path.includes('{name}') && names.length && !request.wrong.length && g(fc.integer, { min: 0, max: 3 }) > 0) {
        request.values.name = g(() => fc.constantFrom(...names));
        request.path = request.operation.path.replace('{name}', () => encodeURIComponent(request.values.name));
    }
}

async function checkMethods(g, operation) {
    const same = description.operations.filter((one) => one.path === operation.path).map((one) => one.method);
    const method = g(() => fc.constantFrom(...['PUT', 'PATCH', 'DELETE', 'POST'].filter((one) => !same.includes(one))));
    const at = operation.path.replace('{id}', 'x').replace('{name}', 'x');
    const request = { operation, method, path: at, headers: {}, body: null, wrong: [] };
    const answer = await send(request);
    const allowed = (answer.headers.allow || '').split(/,\s*/);
    if (answer.status !== 405 || !same.every((one) => allowed.includes(one))) {
        report(request, answer, `${method} is not of this path: 405 with Allow is wanted`);
    }
}

async function one(index) {
    const g = generator(index);
    const operation = turns[index % turns.length];
    counts.sent++;
    if (g(fc.integer, { min: 0, max: 39 }) === 0) {
        await checkMethods(g, operation);
        return;
    }
    const request = requests.draw(g, operation);
    nameCohort(g, request);
    const answer = await send(request);
    counts.bent += request.wrong.length > 0;
    counts.statuses[answer.status] = (counts.statuses[answer.status] || 0) + 1;
    const of = (counts.operations[operation.id] ??= {});
    of[answer.status] = (of[answer.status] || 0) + 1;
    judge(request, answer);
    await remember(request, answer);
}

// Something to begin with: meshes, surfaces, a cohort and a model.
async function plant() {
    const find = (id) => description.operations.find((operation) => operation.id === id);
    const put = async (id, at, type, body) => {
        const request = { operation: find(id), method: 'POST', path: at, headers: {}, type, body, values: {}, wrong: [] };
        const answer = await send(request);
        judge(request, answer);
        await remember(request, answer);
        return answer.status;
    };
    const json = (value) => Buffer.from(JSON.stringify(value));
    for (const mesh of samples.meshes) {
        await put('createMesh', '/v1/meshes', 'application/octet-stream', mesh);
    }
    for (const surface of samples.surfaces) {
        await put('createSurface', '/v1/surfaces', 'application/json', json(surface));
    }
    await put('createCohort', '/v1/cohorts', 'application/json', json(cohortSamples()[0]));
    const inputs = { cohort: 'one', register: false };
    const status = await put('execute', '/v1/processes/pca/execution', 'application/json', json({ inputs }));
    if (status !== 200 || !['mesh', 'surf', 'model', 'cohort'].every((kind) => alive[kind].length)) {
        throw new Error(`the service does not take what the fuzzer starts from (${status})`);
    }
}

async function main() {
    console.log(`seed ${seed}, ${total} requests, ${description.operations.length} operations`);
    await plant();
    for (let i = 0; i < total && violations < VIOLATIONS_MAX; i++) {
        await one(i);
    }
    const silent = description.operations.filter((operation) => !counts.operations[operation.id]);
    const rows = Object.entries(counts.operations).map(([id, of]) => `    ${id}: ${JSON.stringify(of)}`);
    console.log(`${counts.sent} requests, ${counts.bent} that must be refused, statuses ${JSON.stringify(counts.statuses)}`);
    console.log(rows.join('\n'));
    if (silent.length && total >= 400) {
        console.log(`never answered: ${silent.map((operation) => operation.id).join(', ')}`);
        violations++;
    }
    console.log(`${violations} violations (seed ${seed})`);
    agent.destroy();
    return violations ? 1 : 0;
}

main().then(
    (status) => process.exit(status),
    (error) => {
        console.log(error.stack);
        process.exit(1);
    }
);
