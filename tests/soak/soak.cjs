// soak.cjs - cheap requests and small jobs against one daemon, and what it holds meanwhile.
//
//   node soak.cjs URL PID DATA-FOLDER REQUESTS JOBS [GROWTH]
//
// CLIENTS connections that are kept open send GET requests to records, lists, results and what the service says of
// itself; among them JOBS jobs are run, spread evenly: distances between four of the surfaces, in ever new orders, so
// that none comes from the cache. Each job is removed once it has ended, and so leaves nothing.
//
// A hundred times on the way it reads the resident memory and the open descriptors of PID from /proc, and the
// bytes of the database and of its write-ahead log. Growth is the median of the last ten readings over that of
// the ten after the warm-up: the first ten, and 3,000 requests at least, by which every thread of the daemon has opened
// the database for itself. Beyond GROWTH (0.05) for memory, that or
// DATABASE_MAX for the database (which only grows where the log is taken over), DESCRIPTORS_MAX for descriptors and
// LOG_MAX for the log, and for any answer that is not the one expected, it ends with 1.
'use strict';

const fs = require('fs');
const http = require('http');
const path = require('path');

const [base, pid, folder, requestsText, jobsText, growthText] = process.argv.slice(2);
const REQUESTS = Number(requestsText);
const JOBS = Number(jobsText);
const CLIENTS = 8;
const READINGS = 100;
const TEN = 10;
const WARM_UP = Math.max(TEN, Math.ceil((READINGS * 3000) / REQUESTS));
const GROWTH_MAX = Number(growthText || 0.05);
const DATABASE_MAX = 8 << 20; // bytes more than after the warm-up
const DESCRIPTORS_MAX = 4; // more than after the warm-up
const LOG_MAX = 64 << 20; // bytes
const SURFACES = 16;
const DEGREE = 4;

const agent = new http.Agent({ keepAlive: true, maxSockets: CLIENTS });
const surfaces = [];
let sent = 0;
let jobs = 0;

function send(method, at, body) {
    const headers = body ? { 'Content-Type': 'application/json', 'Content-Length': Buffer.byteLength(body) } : {};
    return new Promise((done, fail) => {
        const request = http.request(base + at, { agent, method, headers }, (answer) => {
            const chunks = [];
            answer.on('data', (chunk) => chunks.push(chunk));
            answer.on('end', () =>
                done({ status: answer.statusCode, headers: answer.headers, body: Buffer.concat(chunks) })
            );
        });
        sent++;
        request.on('error', fail);
        request.end(body);
    });
}

async function expectAnswer(status, method, at, body) {
    const answer = await send(method, at, body);
    if (answer.status !== status) {
        throw new Error(`${method} ${at}: ${answer.status}, not ${status}: ${answer.body.toString().slice(0, 300)}`);
    }
    return answer;
}

async function expect(...request) {
    return (await expectAnswer(...request)).body;
}

// Ellipsoids: the harmonics of degree 1, whose indices are y, z, x.
function ellipsoid(i) {
    const column = (at, value) => Array.from({ length: (DEGREE + 1) ** 2 }, (_, k) => (k === at ? value : 0));
    return { coefficients: { lmax: DEGREE, x: column(3, 1), y: column(1, 1 + i / 100), z: column(2, 1.5) } };
}

// The n-th choice of four different surfaces in order.
function choice(n) {
    const left = [...surfaces];
    const chosen = [];
    for (let k = 0; k < 4; k++) {
        chosen.push(left.splice(n % left.length, 1)[0]);
        n = Math.floor(n / (left.length + 1));
    }
    return chosen;
}

async function job(n) {
    const inputs = { surfaces: choice(n), register: false };
    const answer = await expectAnswer(200, 'POST', '/v1/processes/distances/execution', JSON.stringify({ inputs }));
    await expect(200, 'GET', '/v1/jobs?limit=20&status=successful');
    await expect(200, 'DELETE', /<(\/v1\/jobs\/[^>]+)>; rel="monitor"/.exec(answer.headers.link)[1]);
}

const cheap = [
    () => '/healthz',
    (i) => `/v1/surfaces/${surfaces[i % SURFACES]}`,
    () => '/v1/version',
    (i) => `/v1/surfaces/${surfaces[i % SURFACES]}/coefficients`,
    () => '/v1/surfaces?limit=5',
    () => '/v1/processes/encode',
    () => '/v1/jobs?limit=5',
];

// What the daemon holds: [bytes of memory, descriptors, bytes of the database, bytes of its log].
function reading() {
    const status = fs.readFileSync(`/proc/${pid}/status`, 'utf8');
    const bytes = (test) =>
        fs.readdirSync(folder).filter(test).reduce((sum, name) => sum + fs.statSync(path.join(folder, name)).size, 0);
    return [
        1024 * Number(/VmRSS:\s+(\d+)/.exec(status)[1]),
        fs.readdirSync(`/proc/${pid}/fd`).length,
        bytes((name) => /\.(db|sqlite3?)$/.test(name)),
        bytes((name) => name.endsWith('-wal')),
    ];
}

async function client(readings) {
    while (sent < REQUESTS) {
        const due = Math.floor((sent * JOBS) / REQUESTS);
        if (jobs < due) {
            await job(jobs++);
        } else {
            await expect(200, 'GET', cheap[sent % cheap.length](sent));
        }
        if (sent >= ((readings.length + 1) * REQUESTS) / READINGS && readings.length < READINGS) {
            readings.push(reading());
            if (readings.length % TEN === 0) {
                const [memory, descriptors, database, log] = readings.at(-1);
                console.log(
                    `${sent} requests, ${jobs} jobs: ${(memory / 1e6).toFixed(1)} MB resident, ${descriptors} descriptors, ` +
                        `database ${(database / 1e6).toFixed(2)} MB, log ${(log / 1e6).toFixed(2)} MB`
                );
            }
        }
    }
}

function median(readings, member) {
    const sorted = readings.map((one) => one[member]).sort((a, b) => a - b);
    return sorted[Math.floor(sorted.length / 2)];
}

function judge(readings) {
    const early = readings.slice(WARM_UP, WARM_UP + TEN);
    const late = readings.slice(-TEN);
    const growth = (member) => median(late, member) / median(early, member) - 1;
    const descriptors = median(late, 1) - median(early, 1);
    const log = Math.max(...readings.map((one) => one[3]));
    const database = median(late, 2) - median(early, 2);
    const percent = (value) => `${(100 * value).toFixed(2)} %`;
    console.log(
        `after warm-up: memory ${percent(growth(0))}, descriptors ${descriptors}, database ${(database / 1e6).toFixed(2)} MB more, ` +
            `largest log ${(log / 1e6).toFixed(2)} MB`
    );
    const kept = database <= DATABASE_MAX || growth(2) <= GROWTH_MAX;
    return growth(0) <= GROWTH_MAX && kept && descriptors <= DESCRIPTORS_MAX && log <= LOG_MAX;
}

async function main() {
    const readings = [];
    const began = Date.now();
    for (let i = 0; i < SURFACES; i++) {
        surfaces.push(JSON.parse(await expect(201, 'POST', '/v1/surfaces', JSON.stringify(ellipsoid(i)))).id);
    }
    await Promise.all(Array.from({ length: CLIENTS }, () => client(readings)));
    console.log(`${sent} requests, ${jobs} jobs in ${((Date.now() - began) / 1000).toFixed(0)} s`);
    agent.destroy();
    return judge(readings) ? 0 : 1;
}

main().then(
    (status) => process.exit(status),
    (error) => {
        console.log(error.stack);
        process.exit(1);
    }
);
