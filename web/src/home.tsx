// The first screen: what to do where nothing is there yet, and what was done last where something is.
import { useRef, useState } from 'preact/hooks';
import * as api from './api';
import { t } from './i18n';
import { fromHere, link } from './router';
import { caller, jobs, mayChange, refreshJobs, useValue } from './state';
import { Meter, Page, ProblemBox, Shown, plural, size, useLoad, when } from './ui';
import { batch, filesOf, loadExample, sendFiles } from './upload';

export const STATUS: Record<string, string> = {
    accepted: t`waits`, running: t`runs`, successful: t`done`, failed: t`failed`, dismissed: t`canceled`,
};

export function DropZone({ compact }: { compact?: boolean }) {
    const [over, setOver] = useState(false);
    const files = useRef<HTMLInputElement>(null);
    const folder = useRef<HTMLInputElement>(null);
    const pick = (input: HTMLInputElement) => {
        void sendFiles([...input.files!]);
        input.value = '';
    };
    return (
        <section class={`drop${over ? ' over' : ''}${compact ? ' compact' : ''}`} aria-label={t`Upload`}
            onDragOver={(e) => { e.preventDefault(); setOver(true); }}
            onDragLeave={() => setOver(false)}
            onDrop={async (e) => {
                e.preventDefault();
                setOver(false);
                await sendFiles(await filesOf(e.dataTransfer!));
            }}>
            <p class="big">{t`Drop meshes${compact ? t`, a table or an archive` : t` here`}`}</p>
            {!compact && (<>
                <p class="quiet">
                    {t`Any number of files or folders: PLY, OBJ, OFF, STL, VTK, VTP, GIfTI, FreeSurfer, GLB. With a table (CSV: file, label, subject, …) they become a cohort. Also a zip of all of it, an exported study, or a segmentation (NIfTI, NRRD).`}
                </p>
                <details class="quiet"><summary>{t`How a table looks`}</summary>
                    <pre>{t`file,label,subject,time,age
scan01.ply,case,s1,0,41
scan02.ply,case,s1,2,43`}</pre>
                    <p>{t`Only file is needed. label: groups; subject, time, side: what belongs together; all others are covariates.`}</p>
                </details>
            </>)}
            <div class="actions">
                <button class={compact ? '' : 'main'} onClick={() => files.current!.click()}>{t`Choose files`}</button>
                <button onClick={() => folder.current!.click()}>{t`Choose a folder`}</button>
            </div>
            <input ref={files} type="file" multiple hidden aria-label={t`Files to upload`} onChange={(e) => pick(e.currentTarget)} />
            <input ref={folder} type="file" hidden aria-label={t`Folder to upload`} {...{ webkitdirectory: true }} onChange={(e) => pick(e.currentTarget)} />
        </section>
    );
}

const NAMED = 20;
const shortened = (names: string[]): string => names.slice(0, NAMED).join(', ') + (names.length > NAMED ? t` and ${names.length - NAMED} more` : '');

/** How far an upload is, and what became of each file. */
export function Uploads() {
    const state = useValue(batch);
    if (!state) return null;
    const done = state.files.filter((f) => f.state === 'done').length;
    const refused = state.files.filter((f) => f.state === 'refused' || f.doubtful);
    const all = state.files.reduce((sum, f) => sum + f.size, 0);
    const gone = state.files.reduce((sum, f) => sum + f.size * (f.state === 'refused' ? 1 : f.part), 0);
    return (
        <section class="card" aria-label={t`Uploads`}>
            <div class="row">
                <strong>{t`${done} of ${plural(state.files.length, 'file')}`}</strong>
                <Meter value={(100 * gone) / Math.max(1, all)} label={t`Upload, all files`} />
                {state.running ? <button onClick={state.stop}>{t`Stop`}</button>
                    : <button onClick={() => batch.set(null)} aria-label={t`Close the list of uploads`}>{t`Close`}</button>}
            </div>
            {state.files.filter((f) => f.state === 'goes').map((f) => (
                <div class="row small" key={f.name}>
                    <span class="grow">{f.name} <span class="quiet">{size(f.size)}</span></span>
                    <Meter value={100 * f.part} label={f.name} />
                </div>
            ))}
            {refused.length > 0 && (
                <details open={refused.length < 6}>
                    <summary>{t`${plural(refused.length, 'file needs', 'files need')} attention`}</summary>
                    <ul>{refused.slice(0, 100).map((f) => (
                        <li key={f.name}>
                            {f.id ? <a href={link('meshes', f.id)}>{f.name}</a> : f.name}: {f.note}
                        </li>
                    ))}</ul>
                </details>
            )}
            {(state.unmatched.rows.length > 0 || state.unmatched.files.length > 0) && (
                <details open={state.unmatched.files.length > 0 || state.unmatched.rows.length < 6}>
                    <summary>{[[state.unmatched.rows.length, 'row', t`without a mesh`] as const, [state.unmatched.files.length, 'mesh', t`without a row`] as const].filter(([n]) => n)
                        .map(([n, what, text]) => `${plural(n, what, what === 'mesh' ? 'meshes' : `${what}s`)} ${text}`).join(', ')}</summary>
                    {state.unmatched.rows.length > 0 && <p>{t`Rows without a mesh: ${shortened(state.unmatched.rows)}`}</p>}
                    {state.unmatched.files.length > 0 && <p>{t`Meshes without a row: ${shortened(state.unmatched.files)}`}</p>}
                </details>
            )}
            {state.error ? <ProblemBox error={state.error} /> : null}
            {!state.running && (
                <p class="actions">
                    {state.cohort && <a class="button main" href={link('cohorts', state.cohort)}>{t`Open the cohort ${state.cohort}`}</a>}
                    {state.volumes.map((id) => <a class="button" href={link('volumes', id)}>{t`Choose labels of the segmentation`}</a>)}
                    <a class="button" href="#/meshes">{t`All meshes`}</a>
                </p>
            )}
        </section>
    );
}

function Example() {
    const [part, setPart] = useState(-1);
    const [error, setError] = useState<unknown>();
    const start = async () => {
        setError(undefined);
        setPart(0);
        const onward = fromHere();
        try {
            const cohort = await loadExample(setPart);
            refreshJobs();
            onward(link('cohorts', cohort));
        } catch (e) {
            setError(e);
        }
        setPart(-1);
    };
    return (
        <section class="card">
            <h2>{t`Look at an example`}</h2>
            <p>
                {t`Twelve brain nuclei, six of each side, from the AAL atlas (`}<a href="example/licence.txt">{t`source and licence`}</a>{t`). It makes a cohort and starts its mean and components, left against right, and a classification: a minute or two.`}
            </p>
            {part >= 0 ? <Meter value={100 * part} label={t`Loading the example`} />
                : <button class="main" onClick={start}>{t`Load the example`}</button>}
            {error ? <ProblemBox error={error} /> : null}
        </section>
    );
}

export function Home() {
    const who = useValue(caller);
    const recent = useValue(jobs);
    const sent = useValue(batch)?.cohort;
    const cohorts = useLoad(() => api.list('cohorts', { limit: 6 }), [who, sent]);
    const meshes = useLoad(() => api.list('meshes', { limit: 1 }), [who, sent]);
    const empty = cohorts.value?.items.length === 0 && meshes.value?.items.length === 0;
    return (
        <Page title={empty ? t`Start a study` : t`Studies`}>
            {mayChange() && <DropZone />}
            <Uploads />
            <Shown of={cohorts} label={t`cohorts`}>{(page) => (
                <div class="cards">
                    {page.items.map((c) => (
                        <a class="card" href={link('cohorts', c.name)}>
                            <h2>{c.name}</h2>
                            <p class="quiet">{plural(c.memberCount, 'member')}, {when(c.created)}</p>
                        </a>
                    ))}
                    {mayChange() && <Example />}
                </div>
            )}</Shown>
            {recent.length > 0 && (
                <section>
                    <h2>{t`Last analyses`}</h2>
                    <ul class="plain">{recent.slice(0, 6).map((j) => (
                        <li key={j.id}>
                            <a href={link('jobs', j.id)}>{j.name || j.process}</a>{' '}
                            <span class={`state ${j.status}`}>{STATUS[j.status]}</span>{' '}
                            <span class="quiet">{when(j.created)}</span>
                        </li>
                    ))}</ul>
                </section>
            )}
            {who === null && <p>{t`Does the service ask for a token?`} <a href="#/settings">{t`Enter it`}</a></p>}
        </Page>
    );
}
