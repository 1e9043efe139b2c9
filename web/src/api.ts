// The one place that knows the service: where it is, who calls, what its documents look like. Lists come as
// {items, next} or under the name of what they list ({jobs, links}), job ids as id or jobID, what is unknown as null or
// not at all, links as a map or as an array: pages see one form of each.

/** The service is where the page came from, one folder up: also behind a proxy that adds a prefix. */
const root = new URL('..', document.baseURI);

export interface Problem {
    status: number;
    code: string;
    title: string;
    detail: string;
    errors?: { pointer: string; detail: string }[];
    [more: string]: unknown;
}

/** What went wrong, as the service said it. */
export class Failure extends Error {
    constructor(readonly problem: Problem) {
        super(problem.detail || problem.title);
    }
}

export interface MeshProblem { code: string; count: number; first?: number | null; detail: string }
export interface Mesh {
    id: string; name: string; format: string; bytes: number; vertices: number; faces: number; created: string;
    tags: string[];
    report: {
        analysable: boolean; route?: string | null; area?: number | null; volume?: number | null; genus?: number | null;
        closed: boolean; components: number; boundingBoxDiagonal: number;
        starShaped?: { value?: boolean | null; margin?: number | null; center?: number[] } | null;
        repairs: { code: string; count: number }[];
        problems: MeshProblem[];
    };
}
export interface Surface {
    id: string; name: string; lmax: number; area: number; volume: number; scale: number; route?: string | null;
    parameterization: string; created: string; fit?: Record<string, any> | null;
    source?: { mesh?: string | null; job?: string | null; process?: string | null } | null;
}
export interface Member {
    id: string; label?: string | null; subject?: string | null; side?: string | null; time?: number | null;
    mirror?: boolean; covariates?: Record<string, number | string | boolean | null>;
}
export interface Cohort { name: string; memberCount: number; created: string; members?: Member[]; etag?: string }
export type JobStatus = 'accepted' | 'running' | 'successful' | 'failed' | 'dismissed';
export interface Job {
    id: string; name: string; process: string; status: JobStatus; message: string; progress: number;
    secondsLeft?: number; queuePosition?: number; created: string; started?: string; finished?: string; updated?: string;
    problem?: Problem; inputs?: Record<string, any>; tags: string[]; cancelRequested: boolean; build?: string;
}
export interface Schema {
    type?: string | string[]; enum?: (string | number)[]; const?: unknown; default?: unknown; description?: string;
    minimum?: number; maximum?: number; exclusiveMinimum?: number; pattern?: string; items?: Schema; oneOf?: Schema[];
    minItems?: number; maxItems?: number; properties?: Record<string, Schema>; required?: string[];
}
export interface Input { name: string; title: string; description: string; schema: Schema; required: boolean }
export interface Process { id: string; title: string; description: string; inputs: Input[] }
export interface Model {
    id: string; name: string; created: string; lmax: number; subjects: number; components: number;
    eigenvalues: number[]; explained: number[]; cumulative: number[]; labels: string[]; groups?: (string | null)[] | null;
    scores: number[][]; mean: Surface; madeFrom: Record<string, any>; totalVariance: number;
}
export interface Caller { tokens: boolean; role: string; name?: string }

// ---- Who calls ---------------------------------------------------------------------------------------------------

const KEY = 'srnfd-token';
let token = sessionStorage.getItem(KEY) ?? '';

/** A token stays in memory; kept, it lives as long as the tab. It is never part of an address. */
export function setToken(text: string, keep: boolean): void {
    token = text.trim();
    if (keep && token) sessionStorage.setItem(KEY, token);
    else sessionStorage.removeItem(KEY);
}
export const hasToken = (): boolean => token !== '';
const authorization = (): Record<string, string> => (token ? { Authorization: `Bearer ${token}` } : {});

// ---- Requests ----------------------------------------------------------------------------------------------------

/** Told of each answer: 0 where none came, else its status. */
export let watch: (status: number) => void = () => {};
export function watchAnswers(told: (status: number) => void): void {
    watch = told;
}

const address = (path: string): string => new URL(path.replace(/^\//, ''), root).href;

async function problemOf(response: Response): Promise<Problem> {
    const text = await response.text().catch(() => '');
    try {
        return { title: response.statusText, detail: '', ...JSON.parse(text), status: response.status };
    } catch {
        const said = /^\s*</.test(text) ? '' : text.slice(0, 300);
        return {
            status: response.status, code: `http-${response.status}`, title: response.statusText,
            detail: said || `The service answered ${response.status}.`,
        };
    }
}

export const offline = (): Failure =>
    new Failure({ status: 0, code: 'no-answer', title: 'No answer', detail: 'The service does not answer.' });

export async function request(path: string, options: RequestInit = {}): Promise<Response> {
    let response: Response;
    try {
        response = await fetch(address(path), {
            ...options, headers: { ...authorization(), ...(options.headers as Record<string, string>) },
        });
    } catch (error) {
        if ((error as Error).name === 'AbortError') throw error;
        watch(0);
        throw offline();
    }
    watch(response.status);
    if (!response.ok) throw new Failure(await problemOf(response));
    return response;
}

export async function get<T = any>(path: string, signal?: AbortSignal): Promise<T> {
    return (await request(path, { signal })).json();
}

export async function send<T = any>(method: string, path: string, body?: unknown, headers = {}): Promise<T> {
    const response = await request(path, {
        method,
        headers: { ...(body === undefined ? {} : { 'Content-Type': 'application/json' }), ...headers },
        body: body === undefined ? undefined : JSON.stringify(body),
    });
    const text = await response.text();
    return (text ? JSON.parse(text) : undefined) as T;
}

export const bytes = async (path: string, signal?: AbortSignal): Promise<ArrayBuffer> =>
    (await request(path, { signal })).arrayBuffer();

/** An upload that tells how far it is, from 0 to 1: fetch cannot. */
export function upload<T>(path: string, body: Blob | FormData, type: string, told: (part: number) => void,
    signal?: AbortSignal): Promise<T> {
    return new Promise((resolve, reject) => {
        const call = new XMLHttpRequest();
        call.open('POST', address(path));
        for (const [name, value] of Object.entries(authorization())) call.setRequestHeader(name, value);
        if (type) call.setRequestHeader('Content-Type', type);
        call.upload.onprogress = (event) => told(event.total ? event.loaded / event.total : 0);
        call.onload = async () => {
            watch(call.status);
            if (call.status < 300) resolve(JSON.parse(call.responseText));
            else reject(new Failure(await problemOf(new Response(call.responseText, { status: call.status }))));
        };
        call.onerror = () => {
            watch(0);
            reject(offline());
        };
        call.onabort = () => reject(new DOMException('canceled', 'AbortError'));
        signal?.addEventListener('abort', () => call.abort());
        call.send(body);
    });
}

// ---- Lists -------------------------------------------------------------------------------------------------------

export interface Page<T> { items: T[]; next: string | null; total?: number }

function pageOf<T>(document: any, name: string): Page<T> {
    const items = document.items ?? document[name] ?? [];
    return { items, next: document.next ?? null, total: document.total ?? undefined };
}

export async function list<T>(name: string, query: Record<string, string | number> = {}): Promise<Page<T>> {
    const text = new URLSearchParams(Object.entries(query).map(([key, value]) => [key, `${value}`])).toString();
    return pageOf(await get(`/v1/${name}${text ? `?${text}` : ''}`), name);
}

/** All of a list, page by page; told of what is there so far. */
export async function listAll<T>(name: string, told: (items: T[]) => void, stop: () => boolean): Promise<void> {
    let items: T[] = [];
    let cursor: string | null = null;
    do {
        const page: Page<T> = await list<T>(name, cursor ? { limit: 200, cursor } : { limit: 200 });
        if (stop()) return;
        items = items.concat(page.items);
        cursor = page.next;
        told(items);
    } while (cursor);
}

// ---- Documents ---------------------------------------------------------------------------------------------------

export function jobOf(d: any): Job {
    return {
        id: d.id ?? d.jobID, name: d.name ?? '', process: d.processID, status: d.status, message: d.message ?? '',
        progress: d.progress ?? 0, secondsLeft: d.estimatedSecondsLeft ?? undefined,
        queuePosition: d.queuePosition ?? undefined, created: d.created, started: d.started ?? undefined,
        finished: d.finished ?? undefined, updated: d.updated ?? undefined, problem: d.exception ?? undefined,
        inputs: d.inputs, tags: d.tags ?? [], cancelRequested: !!d.cancelRequested, build: d.numericBuild,
    };
}

export async function jobs(limit = 50, cursor?: string): Promise<Page<Job>> {
    const page = await list<any>('jobs', cursor ? { limit, cursor } : { limit });
    return { ...page, items: page.items.map(jobOf) };
}
export const job = async (id: string): Promise<Job> => jobOf(await get(`/v1/jobs/${id}`));
export const results = (id: string): Promise<any> => get(`/v1/jobs/${id}/results`);
export const cancel = (id: string): Promise<unknown> => send('POST', `/v1/jobs/${id}/cancel`);

/** "maxIterations" as people write it. */
export const words = (name: string): string => {
    const text = name === 'lmax' ? 'degree (lmax)' : name.replace(/([a-z])([A-Z])/g, '$1 $2').toLowerCase();
    return text[0].toUpperCase() + text.slice(1);
};

/** Inputs of a process, described as one JSON Schema of an object or as a map of one schema each. */
export function processOf(d: any): Process {
    const given = d.inputs ?? {};
    const isSchema = given.properties && (given.type === 'object' || given.$schema);
    const inputs = isSchema
        ? Object.entries<Schema>(given.properties).map(([name, schema]) => ({
            name, title: words(name), description: schema.description ?? '', schema,
            required: (given.required ?? []).includes(name),
        }))
        : Object.entries<any>(given).map(([name, input]) => ({
            name, title: input.title ?? words(name), description: input.description ?? input.schema?.description ?? '',
            schema: input.schema ?? {}, required: (input.minOccurs ?? 1) > 0 && input.schema?.default === undefined,
        }));
    return { id: d.id, title: d.title ?? d.id, description: d.description ?? '', inputs };
}

export const processes = async (): Promise<Page<any>> => pageOf<any>(await get('/v1/processes'), 'processes');
export const process = async (id: string): Promise<Process> => processOf(await get(`/v1/processes/${id}`));

export async function execute(id: string, inputs: Record<string, unknown>, name?: string): Promise<Job> {
    const body = name ? { inputs, name } : { inputs };
    return jobOf(await send('POST', `/v1/processes/${id}/execution`, body, { Prefer: 'respond-async' }));
}

/** Runs a short process and waits for its results. */
export async function run<T = any>(id: string, inputs: Record<string, unknown>, signal?: AbortSignal): Promise<T> {
    for (;;) {
        const response = await request(`/v1/processes/${id}/execution`, {
            method: 'POST', signal, headers: { 'Content-Type': 'application/json', Prefer: 'wait=60' },
            body: JSON.stringify({ inputs }),
        });
        if (response.status === 200) return response.json();
        await response.text();
    }
}

export async function cohort(name: string): Promise<Cohort> {
    const response = await request(`/v1/cohorts/${encodeURIComponent(name)}`);
    return { ...(await response.json()), etag: response.headers.get('ETag') ?? undefined };
}

// ---- Events ------------------------------------------------------------------------------------------------------

/** Nothing heard for so long, not even the sign of life that comes every 15 seconds: the connection is dead. */
const SILENCE_MS = 45000;

export interface StreamEvent { name: string; id: string; data: string }

/**
 * Server-sent events by fetch: EventSource cannot send a token, and a ticket opens one stream only. Goes on after the
 * event of that id, and ends when the stream does.
 */
export async function events(path: string, last: string, told: (event: StreamEvent) => void,
    signal: AbortSignal): Promise<void> {
    const silence = new AbortController();
    signal.addEventListener('abort', () => silence.abort());
    let timer = setTimeout(() => silence.abort(), SILENCE_MS);
    try {
        const headers: Record<string, string> = { Accept: 'text/event-stream', ...(last ? { 'Last-Event-ID': last } : {}) };
        const response = await request(path, { signal: silence.signal, headers });
        const reader = response.body!.pipeThrough(new TextDecoderStream()).getReader();
        let rest = '';
        for (;;) {
            const { value, done } = await reader.read();
            if (done) return;
            clearTimeout(timer);
            timer = setTimeout(() => silence.abort(), SILENCE_MS);
            rest += value;
            const parts = rest.split('\n\n');
            rest = parts.pop()!;
            for (const part of parts) {
                const lines = part.split('\n');
                const of = (name: string) =>
                    lines.filter((l) => l.startsWith(`${name}:`)).map((l) => l.slice(name.length + 1).trimStart()).join('\n');
                if (of('data')) told({ name: of('event'), id: of('id'), data: of('data') });
            }
        }
    } finally {
        clearTimeout(timer);
    }
}
