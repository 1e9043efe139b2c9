// siege.cjs - all that one who means harm can do at once, and what a well-behaved caller has meanwhile.
//
//   node siege.cjs attack URL SECONDS TOKENS BOMB-FILE IDLE STALLED
//   node siege.cjs behave URL SECONDS TOKEN
//
// Two processes, so that neither side waits for the other's. attack, for so many seconds and with its tokens (separated by
// commas) in turn: uploads of a small file that unpacks to
// millions of vertices, each another file by its last bytes; bodies of JSON that would be large documents; executions
// that compute for long; IDLE connections from eight addresses with one request each that then say nothing, and come
// again when they are closed; and STALLED bodies that stop before their end. behave: lists of jobs and meshes, /readyz, and now and then a small mesh. Each prints, as JSON, its
// answers by status; behave the times of them in ms, too.
'use strict';

const fs = require('fs');
const http = require('http');
const net = require('net');

const [side, base, secondsText, tokens, bombFile, idleText, stalledText] = process.argv.slice(2);
const bad = tokens.split(',');
const url = new URL(base);
const end = Date.now() + 1000 * Number(secondsText);
const bomb = bombFile ? fs.readFileSync(bombFile) : null;
const statuses = {};
const times = [];
const slowest = {};
const uploads = [];
let made = 0;

function count(status) {
    statuses[status] = (statuses[status] || 0) + 1;
}

function send(agent, method, path, token, type, body) {
    const started = process.hrtime.bigint();
    return new Promise((resolve) => {
        const headers = { Authorization: `Bearer ${token}` };
        if (body) {
            headers['Content-Type'] = type;
            headers['Content-Length'] = body.length;
        }
        const request = http.request(new URL(path, base), { method, agent, headers }, (response) => {
            const parts = [];
            response.on('data', (part) => parts.push(part));
            response.on('end', () => {
                count(response.statusCode);
                resolve({ body: Buffer.concat(parts), ms: Number(process.hrtime.bigint() - started) / 1e6 });
            });
            response.on('error', () => resolve({ body: Buffer.alloc(0), ms: 0 }));
        });
        request.on('error', () => {
            count('none');
            resolve({ body: Buffer.alloc(0), ms: 0 });
        });
        request.end(body);
    });
}

const pause = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

async function uploadBombs(number) {
    const agent = new http.Agent({ keepAlive: true });
    while (Date.now() < end) {
        const body = Buffer.concat([bomb, Buffer.from(`<!-- ${made++} -->`)]);
        await send(agent, 'POST', '/v1/meshes?format=gii', bad[number % bad.length], 'application/octet-stream', body);
    }
}

async function sendDocuments(number) {
    const agent = new http.Agent({ keepAlive: true });
    const text = Buffer.from(`{"name":"a","members":[${'{},'.repeat(2500000)}{}]}`);
    while (Date.now() < end) {
        await send(agent, 'POST', '/v1/cohorts', bad[number % bad.length], 'application/json', text);
    }
}

async function compute(number) {
    const agent = new http.Agent({ keepAlive: true });
    const token = bad[number % bad.length];
    const mesh = fs.readFileSync('tests/data/aal_subcortex/L_thalamus.ply');
    const sent = await send(agent, 'POST', '/v1/meshes', token, 'application/octet-stream', mesh);
    const id = JSON.parse(sent.body).id;
    for (let i = 0; i < 20 && Date.now() < end; i++) {
        const inputs = { srnf: { surface: id }, initial: 'sphere', lmax: 40, tolerance: 1e-30, maxIterations: 50000 + i };
        await send(agent, 'POST', '/v1/processes/invert/execution', token, 'application/json',
            Buffer.from(JSON.stringify({ inputs })));
    }
}

// From one of eight addresses of the loopback in turn. One that gave way comes again.
const held = new Set();
function connect(text, number, stalls) {
    const options = { host: url.hostname, port: Number(url.port), localAddress: `127.0.0.${2 + (number % 8)}` };
    const socket = net.connect(options, () => {
        socket.write(text);
        if (stalls) {
            socket.write(Buffer.alloc(32 << 20));
        }
    });
    socket.on('error', () => {});
    socket.on('close', () => {
        held.delete(socket);
        if (Date.now() < end) {
            setTimeout(() => connect(text, number, stalls), 100);
        }
    });
    socket.resume();
    held.add(socket);
}

async function behave() {
    const agent = new http.Agent({ keepAlive: true, maxSockets: 1 });
    const mesh = fs.readFileSync('tests/data/aal_subcortex/R_thalamus.ply');
    for (let i = 0; Date.now() < end; i++) {
        const paths = ['/v1/jobs?limit=10', '/readyz', '/v1/meshes?limit=10'];
        const took = (await send(agent, 'GET', paths[i % 3], bad[0])).ms;
        times.push(took);
        slowest[paths[i % 3]] = Math.max(slowest[paths[i % 3]] || 0, took);
        if (i % 40 === 20) {
            const body = Buffer.concat([mesh, Buffer.from('\n'.repeat(i))]);
            uploads.push((await send(agent, 'POST', '/v1/meshes', bad[0], 'application/octet-stream', body)).ms);
        }
        await pause(10);
    }
    agent.destroy();
}

function quantile(list, part) {
    const sorted = [...list].sort((a, b) => a - b);
    return sorted[Math.min(sorted.length - 1, Math.ceil(part * sorted.length) - 1)];
}

async function attack() {
    for (let i = 0; i < Number(idleText); i++) {
        connect(`GET /healthz HTTP/1.1\r\nHost: ${url.host}\r\n\r\n`, i);
    }
    for (let i = 0; i < Number(stalledText); i++) {
        connect(`POST /v1/meshes HTTP/1.1\r\nHost: ${url.host}\r\n` +
            `Authorization: Bearer ${bad[i % bad.length]}\r\nContent-Length: 33554432\r\n\r\n`, i, true);
    }
    for (let i = 0; i < 6; i++) {
        uploadBombs(i);
    }
    for (let i = 0; i < 4; i++) {
        sendDocuments(i);
    }
    compute(0);
    await pause(end - Date.now());
    console.log(JSON.stringify({ statuses, held: held.size }));
    process.exit(0);
}

async function measure() {
    await behave();
    console.log(JSON.stringify({
        statuses, requests: times.length,
        median: quantile(times, 0.5), p99: quantile(times, 0.99), slowest,
        uploads: uploads.length, medianUpload: uploads.length ? quantile(uploads, 0.5) : 0,
        slowestUpload: uploads.length ? Math.max(...uploads) : 0,
    }));
}

if (side === 'attack') {
    attack();
} else {
    measure();
}
