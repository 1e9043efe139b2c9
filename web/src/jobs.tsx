// The history of jobs, and one job: how far it is, what it was given, what it found.
import { useEffect, useState } from 'preact/hooks';
import * as api from './api';
import { link } from './router';
import { isActive, jobs, mayChange, refreshJobs, useValue } from './state';
import { cancelJob, progressText } from './tray';
import { LongTable, Meter, Page, ProblemBox, Shown, Sure, later, span, useLoad, when } from './ui';
import { STATUS } from './home';
import { t } from './i18n';
import { aText, oneOf, useKept } from './kept';

const SEARCH_PAUSE_MS = 300;
/** Ids of processes, once they were asked for. */
let known: Promise<string[]> | undefined;

const Results = later<{ job: api.Job }>(() => import('./results').then((m) => m.Results));

const took = (job: api.Job): string =>
    job.started && job.finished ? span((Date.parse(job.finished) - Date.parse(job.started)) / 1000) : '–';

export function Jobs() {
    const recent = useValue(jobs);
    const [all, setAll] = useState<api.Job[]>([]);
    const [next, setNext] = useState<string | null | undefined>(undefined);
    const [find, setFind] = useKept('find', '', aText);
    const [state, setState] = useKept('state', '', oneOf(Object.keys(STATUS)));
    useEffect(() => {
        void api.jobs().then((page) => setNext(page.next), () => {});
    }, []);
    // What is not listed yet is found by its name or its process, in all of the history.
    const [older, setOlder] = useState<api.Job[]>([]);
    useEffect(() => {
        const text = find.trim();
        setOlder([]);
        if (!text || next === null) return;
        let gone = false;
        const timer = setTimeout(async () => {
            const processes = await (known ??= api.list('processes').then(({ items }) => items.map((p) => p.id), () => []));
            const asked: Record<string, string>[] = [{ name: text }, ...processes.filter((id) => id === text.toLowerCase()).map((process) => ({ process }))];
            void Promise.all(asked.map((by) => api.jobs({ limit: 200, ...by }).then((page) => page.items, () => []))).then((found) => gone || setOlder(found.flat()));
        }, SEARCH_PAUSE_MS);
        return () => {
            gone = true;
            clearTimeout(timer);
        };
    }, [find, next]);
    const more = async () => {
        const page = await api.jobs({ limit: 200, cursor: next! });
        setAll(all.concat(page.items));
        setNext(page.next);
    };
    const found = new Set(older.map((j) => j.id));
    const byId = new Map([...older, ...all, ...recent].map((j) => [j.id, j]));
    const list = [...byId.values()].sort((a, b) => b.created.localeCompare(a.created))
        .filter((j) => (!state || j.status === state) && (found.has(j.id) || `${j.name} ${j.process} ${j.id} ${j.tags.join(' ')}`.toLowerCase().includes(find.toLowerCase())));
    return (
        <Page title={t`Jobs`}>
            <div class="row tools">
                <label>{t`Search`} <input type="search" value={find} onInput={(e) => setFind(e.currentTarget.value)} /></label>
                <label>{t`State`} <select value={state} onChange={(e) => setState(e.currentTarget.value)}>
                    <option value="">{t`all`}</option>
                    {Object.entries(STATUS).map(([value, text]) => <option value={value}>{text}</option>)}
                </select></label>
            </div>
            {list.length === 0 ? <p class="quiet">{t`No job ${find || state ? t`fits` : t`yet: start an analysis of a cohort`}.`}</p> : (
                <LongTable label={t`Jobs`} items={list} keyOf={(j) => j.id}
                    columns={[{ title: t`Analysis`, by: (j) => j.name || j.process }, { title: t`State`, width: '17rem', by: (j) => STATUS[j.status] }, { title: t`Took`, width: '7rem', by: (j) => (j.started && j.finished ? Date.parse(j.finished) - Date.parse(j.started) : null) },
                        { title: t`Started`, width: '12rem', by: (j) => j.created }, { title: t`Cancel`, hidden: true, width: '6rem' }]}
                    row={(j) => [
                        <a href={link('jobs', j.id)}>{j.name ? `${j.name} (${j.process})` : j.process}</a>,
                        isActive(j) ? <span class="row"><Meter value={j.progress} label={t`Progress of ${j.process}`} /><span class="quiet">{progressText(j)}</span></span>
                            : <span class={`state ${j.status}`}>{STATUS[j.status]}</span>,
                        took(j), when(j.created),
                        isActive(j) && mayChange() ? <button onClick={() => void cancelJob(j)} aria-label={t`Cancel ${j.name || j.process}`}>{t`Cancel`}</button> : null,
                    ]} />
            )}
            {next && <p><button onClick={more}>{t`Show older ones`}</button></p>}
        </Page>
    );
}

/** Inputs as a query, so that the form can be opened with them. */
export const rerunLink = (job: api.Job): string => `${link('analyses', job.process)}?rerun=${job.id}`;

function Inputs({ job }: { job: api.Job }) {
    if (!job.inputs) return null;
    const text = (value: any): string =>
        value && typeof value === 'object' && !Array.isArray(value) && value.name && value.surfaces
            ? t`${value.name} (${value.surfaces.length} members)` : JSON.stringify(value);
    return (
        <details>
            <summary>{t`What it was given`}</summary>
            <dl class="pairs">{Object.entries(job.inputs).map(([name, value]) => {
                const said = text(value);
                return <><dt>{name}</dt><dd>{said.length > 300 ? `${said.slice(0, 300)}…` : said}</dd></>;
            })}</dl>
            {job.build && <p class="quiet">{job.build}</p>}
        </details>
    );
}

export function JobPage({ id }: { id: string }) {
    const live = useValue(jobs).find((j) => j.id === id);
    const loaded = useLoad(() => api.job(id), [id, live?.status]);
    const [error, setError] = useState<unknown>();
    const [gone, setGone] = useState(false);
    const remove = async () => {
        try {
            await api.send('delete', '/v1/jobs/{id}', { id });
            setGone(true);
            refreshJobs();
        } catch (e) {
            setError(e);
        }
    };
    useEffect(() => {
        if (!live && loaded.value && isActive(loaded.value)) {
            const timer = setTimeout(loaded.reload, 1500);
            return () => clearTimeout(timer);
        }
    }, [live, loaded.value]);
    if (gone) return <Page title={t`Job removed`}><a href="#/jobs">{t`All jobs`}</a></Page>;
    return (
        <Shown of={loaded} page label={t`the job`}>{(first) => {
            const job: api.Job = live ? { ...first, ...live, inputs: first.inputs } : first;
            return (
                <Page title={job.name || job.process} actions={mayChange() && (
                    <>
                        <a class="button" href={rerunLink(job)}>{t`Run again with changes`}</a>
                        {isActive(job) ? <button onClick={() => void cancelJob(job)}>{t`Cancel`}</button>
                            : <Sure question={t`Remove this job and its results? It can be computed again.`} onYes={remove}>{t`Remove`}</Sure>}
                    </>
                )}>
                    <p class="quiet">
                        {job.process}, <span class={`state ${job.status}`}>{STATUS[job.status]}</span>{t`, started ${when(job.created)}${job.finished ? t`, took ${took(job)}` : ''}`}
                    </p>
                    {error ? <ProblemBox error={error} /> : null}
                    {isActive(job) && (
                        <section class="card" aria-label={t`Progress`}>
                            <Meter value={job.progress} label={t`Progress`} />
                            <p>{progressText(job)}</p>
                        </section>
                    )}
                    {job.problem && <ProblemBox error={new api.Failure(job.problem)} />}
                    {job.status === 'successful' && <Results job={job} />}
                    <Inputs job={job} />
                </Page>
            );
        }}</Shown>
    );
}
