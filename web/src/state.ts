// What all pages share: the connection, who calls, the jobs. A value with listeners, and a hook for it.
import { useEffect, useState } from 'preact/hooks';
import * as api from './api';

export class Value<T> {
    private listeners = new Set<() => void>();
    constructor(private current: T) {}
    get(): T {
        return this.current;
    }
    set(next: T): void {
        if (next === this.current) return;
        this.current = next;
        for (const listener of [...this.listeners]) listener();
    }
    listen(listener: () => void): () => void {
        this.listeners.add(listener);
        return () => this.listeners.delete(listener);
    }
}

export function useValue<T>(value: Value<T>): T {
    const [, again] = useState(0);
    useEffect(() => value.listen(() => again((n) => n + 1)), [value]);
    return value.get();
}

/** up: it answers. down: it does not. token: it asks for one. */
export const connection = new Value<'up' | 'down' | 'token'>('up');
export const caller = new Value<api.Caller | null>(null);
export const jobs = new Value<api.Job[]>([]);
/** Said to those who hear the page, and shown for a moment to those who see it. */
export const notice = new Value<string>('');
export const say = (text: string): void => {
    notice.set('');
    notice.set(text);
};

/** Viewers may look only. */
export const mayChange = (): boolean => !['viewer', 'metrics'].includes(caller.get()?.role ?? 'user');

export const isActive = (job: api.Job): boolean => job.status === 'accepted' || job.status === 'running';

api.watchAnswers((status) => {
    if (status === 0 || status === 502 || status === 504) {
        if (connection.get() !== 'token') connection.set('down');
        again(2000);
    } else if (status === 401) connection.set('token');
    else if (connection.get() === 'down') {
        // Not where a token is asked for: what is open to everyone is answered there too.
        connection.set('up');
        void whoCalls();
    }
});

export async function whoCalls(): Promise<void> {
    try {
        caller.set(await api.get<api.Caller>('/v1/caller'));
    } catch (error) {
        if (error instanceof api.Failure && error.problem.status === 404) caller.set({ tokens: false, role: 'user' });
    }
}

// ---- Jobs: asked for often while any runs, and one stream for the job that runs ---------------------------------------

let timer = 0;
let due = 0;
let asking = false;
const ended = new Value<api.Job | null>(null);
export const onEnd = (told: (job: api.Job) => void): (() => void) =>
    ended.listen(() => {
        const job = ended.get();
        if (job) told(job);
    });

function again(ms: number): void {
    const at = Date.now() + ms;
    if (timer && due <= at) return;
    clearTimeout(timer);
    due = at;
    timer = window.setTimeout(() => {
        timer = 0;
        void ask();
    }, ms);
}

/** Looks at the jobs now, as after one was started. */
export const refreshJobs = (): void => again(50);

function take(list: api.Job[]): void {
    const before = new Map(jobs.get().map((job) => [job.id, job]));
    jobs.set(list);
    for (const job of list) {
        const was = before.get(job.id);
        if (was && isActive(was) && !isActive(job)) {
            ended.set(job);
            say(`${job.name || job.process}: ${job.status}`);
        }
    }
}

async function ask(): Promise<void> {
    if (asking) return again(200);
    asking = true;
    try {
        const page = await api.jobs(50);
        take(page.items);
    } catch {
        /* The connection's state says it. */
    }
    asking = false;
    const active = jobs.get().some(isActive);
    if (connection.get() === 'token') return;
    again(connection.get() === 'down' ? 2000 : document.hidden ? 15000 : active ? 1500 : 20000);
    follow();
}

let following = '';
/** The stream of the first job that runs: one, as browsers open six connections to a host at most. */
function follow(): void {
    const job = jobs.get().find((j) => j.status === 'running');
    if (!job || following === job.id) return;
    following = job.id;
    const stop = new AbortController();
    api.events(`/v1/jobs/${job.id}/events`, (_event, data) => {
        const next = api.jobOf(JSON.parse(data));
        if (next.id === job.id) take(jobs.get().map((j) => (j.id === next.id ? { ...j, ...next } : j)));
    }, stop.signal)
        .catch(() => {})
        .finally(() => {
            following = '';
            again(300);
        });
}

document.addEventListener('visibilitychange', () => !document.hidden && again(0));
