// The one place that knows the service: where it is, who calls, what its documents look like. Lists come as
// {items, next} or under the name of what they list ({jobs, links}), job ids as id or jobID, what is unknown as null or
// not at all, links as a map or as an array: pages see one form of each.
import type { Answer, Cohort, Estimate, Inputs, Item, JobDocument, JobStatus, List, Method, Outputs, Problem, ProcessId, Received, Route, SendRoute, Sent } from './documents';
import { t } from './i18n';

export type * from './documents';

/** The service is where the page came from, one folder up: also behind a proxy that adds a prefix. */
const root = new URL('..', document.baseURI);

/** What went wrong, as the service said it. */
export class Failure extends Error {
    constructor(readonly problem: Problem) {
        super(problem.detail || problem.title);
    }
}

export interface Job {
    id: string; name: string; process: string; status: JobStatus; message: string; progress: number;
    secondsLeft?: number; queuePosition?: number; created: string; started?: string; finished?: string; updated?: string;
    problem?: Problem; inputs?: Record<string, any>; tags: string[]; cancelRequested: boolean; build?: string;
}
export interface Schema {
    type?: string | string[]; enum?: (string | number)[]; const?: unknown; default?: unknown; description?: string;
    minimum?: number; maximum?: number; exclusiveMinimum?: number; pattern?: string; items?: Schema; oneOf?: Schema[];
    minItems?: number; maxItems?: number; properties?: Record<string, Schema>; required?: string[]; additionalProperties?: boolean | Schema;
}
export interface Input { name: string; title: string; description: string; schema: Schema; required: boolean }
export interface Process { id: string; title: string; description: string; inputs: Input[] }
export type Caller = Answer<'/v1/caller'>;

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
            detail: said || t`The service answered ${response.status}.`,
        };
    }
}

export const offline = (): Failure =>
    new Failure({ status: 0, code: 'no-answer', title: t`No answer`, detail: t`The service does not answer.` });

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

/** A route with its parameters in place. */
export const pathOf = (route: string, parameters: Record<string, string> = {}): string =>
    route.replace(/\{(\w+)\}/g, (_, name) => encodeURIComponent(parameters[name]));

export async function get<P extends Route>(route: P, parameters: Record<string, string> = {}, signal?: AbortSignal): Promise<Answer<P>> {
    return (await request(pathOf(route, parameters), { signal })).json();
}

/** Sends what the route takes, and returns what it answers. */
export async function send<P extends SendRoute<M>, M extends Method>(method: M, route: P, parameters: Record<string, string>, body?: Sent<P, M>,
    headers = {}): Promise<Received<P, M>> {
    const response = await request(pathOf(route, parameters), {
        method: method.toUpperCase(),
        headers: { ...(body === undefined ? {} : { 'Content-Type': 'application/json' }), ...headers },
        body: body === undefined ? undefined : JSON.stringify(body),
    });
    const text = await response.text();
    return (text ? JSON.parse(text) : undefined) as Received<P, M>;
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

export async function list<N extends List>(name: N, query: Record<string, string | number> = {}): Promise<Page<Item<N>>> {
    const text = new URLSearchParams(Object.entries(query).map(([key, value]) => [key, `${value}`])).toString();
    const document = await (await request(`/v1/${name}${text ? `?${text}` : ''}`)).json();
    return { items: document.items ?? document[name] ?? [], next: document.next ?? null, total: document.total ?? undefined };
}

/** All of a list, page by page; told of what is there so far. */
export async function listAll<N extends List>(name: N, told: (items: Item<N>[]) => void, stop: () => boolean): Promise<void> {
    let items: Item<N>[] = [];
    let cursor: string | null = null;
    do {
        const page: Page<Item<N>> = await list(name, cursor ? { limit: 200, cursor } : { limit: 200 });
        if (stop()) return;
        items = items.concat(page.items);
        cursor = page.next;
        told(items);
    } while (cursor);
}

// ---- Documents ---------------------------------------------------------------------------------------------------

export function jobOf(d: JobDocument): Job {
    return {
        id: d.id, name: d.name ?? '', process: d.processID, status: d.status, message: d.message ?? '',
        progress: d.progress ?? 0, secondsLeft: d.estimatedSecondsLeft ?? undefined,
        queuePosition: d.queuePosition ?? undefined, created: d.created, started: d.started ?? undefined,
        finished: d.finished ?? undefined, updated: d.updated ?? undefined, problem: d.exception as Problem | undefined,
        inputs: d.inputs, tags: d.tags ?? [], cancelRequested: !!d.cancelRequested, build: d.numericBuild,
    };
}

export async function jobs(query: Record<string, string | number> = {}): Promise<Page<Job>> {
    const page = await list('jobs', { limit: 50, ...query });
    return { ...page, items: page.items.map(jobOf) };
}
export const job = async (id: string): Promise<Job> => jobOf(await get('/v1/jobs/{id}', { id }));
/** Of a job of that process. */
export const results = async <P extends ProcessId>(id: string): Promise<Outputs<P>> => (await request(pathOf('/v1/jobs/{id}/results', { id }))).json();
export const cancel = (id: string): Promise<unknown> => send('post', '/v1/jobs/{id}/cancel', { id });

/** "maxIterations" as people write it. */
export const words = (name: string): string => {
    const text = name === 'lmax' ? 'degree (lmax)' : name.replace(/([a-z0-9])([A-Z])/g, '$1 $2').toLowerCase();
    return text[0].toUpperCase() + text.slice(1);
};

export function processOf(d: Answer<'/v1/processes/{id}'>): Process {
    const inputs = Object.entries(d.inputs).map(([name, input]) => {
        const schema = input.schema as Schema;
        return {
            name, title: name === 'lmax' ? words(name) : input.title ?? words(name), description: input.description ?? schema.description ?? '', schema,
            required: input.minOccurs > 0 && schema.default === undefined,
        };
    });
    return { id: d.id, title: d.title ?? d.id, description: d.description ?? '', inputs };
}

export const process = async (id: string): Promise<Process> => processOf(await get('/v1/processes/{id}', { id }));

export async function execute(id: string, inputs: Record<string, unknown>, name?: string): Promise<Job> {
    const body = name ? { inputs, name } : { inputs };
    const text = JSON.stringify(body);
    const answer = await request(pathOf('/v1/processes/{id}/execution', { id }), {
        method: 'POST', headers: { 'Content-Type': 'application/json', Prefer: 'respond-async' }, body: text,
    });
    return jobOf(await answer.json());
}

/** What an execution would take; the problem where it would be refused. */
export const estimate = async (id: string, inputs: Record<string, unknown>, signal?: AbortSignal): Promise<Estimate> =>
    (await request(`/v1/processes/${id}/estimate`, {
        method: 'POST', signal, headers: { 'Content-Type': 'application/json' }, body: JSON.stringify({ inputs }),
    })).json();

/** Runs a short process and waits for its results. */
export async function run<P extends ProcessId>(id: P, inputs: Inputs<P>, signal?: AbortSignal): Promise<Outputs<P>> {
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
