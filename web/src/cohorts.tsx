// Cohorts: members with labels and covariates, edited as in a spreadsheet, and what can be asked of them.
import { useState } from 'preact/hooks';
import * as api from './api';
import { namesOf } from './names';
import { go, link } from './router';
import { jobs, mayChange, say, useValue } from './state';
import { parseTable } from './table';
import { LongTable, Page, ProblemBox, Shown, Sure, csv, later, plural, save, useLoad, when } from './ui';
import { DropZone, STATUS, Uploads } from './home';
import { match, sideOf } from './upload';

const Gallery = later<any>(() => import('./shape').then((m) => m.Gallery));

export function Cohorts() {
    const cohorts = useLoad(() => api.list('cohorts', { limit: 200 }), []);
    return (
        <Page title="Cohorts">
            {mayChange() && <DropZone compact />}
            <Uploads />
            <Shown of={cohorts}>{(page) => page.items.length === 0
                ? <p class="quiet">No cohort yet. Drop meshes with a table, choose some under <a href="#/meshes">Meshes</a>, or load the example from the <a href="#/">start</a>.</p>
                : <div class="cards">{page.items.map((c) => (
                    <a class="card" href={link('cohorts', c.name)}><h2>{c.name}</h2><p class="quiet">{plural(c.memberCount, 'member')}, {when(c.created)}</p></a>
                ))}</div>}</Shown>
        </Page>
    );
}

/** Questions that people ask, the process that answers each, and what the cohort lacks for it: nothing or a word. */
type Question = [id: string, title: string, text: string, lacks?: (members: api.Member[]) => string | false];
const differ = (values: unknown[]): boolean => new Set(values.filter((v) => v !== null && v !== undefined && v !== '')).size > 1;
const twoLabels = (members: api.Member[]) => !differ(members.map((m) => m.label)) && 'needs two labels';
const partsOf = (members: api.Member[]) => members.map((m) => m.covariates?.part);
const QUESTIONS: Question[] = [
    ['pca', 'Mean and components', 'How do these shapes vary?'],
    ['compare-groups', 'Compare groups', 'Do two groups differ, and where?', twoLabels],
    ['classify', 'Classify', 'Can the group be told from the shape?', twoLabels],
    ['distances', 'Distances', 'Which shapes are alike?'],
    ['mean', 'Mean', 'The shape in the middle'],
    ['evaluate-model', 'Quality', 'How well does a model describe them?'],
    ['regress', 'Linear model', 'How does shape depend on covariates?'],
    ['change', 'Change', 'What happens between two visits of a subject?', (members) => (!members.some((m) => m.subject) || !differ(members.map((m) => m.time))) && 'needs subjects and two times'],
    ['asymmetry', 'Asymmetry', 'How do left and right sides differ?', (members) => (!members.some((m) => m.subject) || !differ(members.map((m) => m.side))) && 'needs subjects and both sides'],
    ['trajectories', 'Trajectories', 'How do subjects change over time, and who is unlike the others?', (members) => (!members.some((m) => m.subject) || !differ(members.map((m) => m.time))) && 'needs subjects and times'],
    ['pca-parts', 'Several structures', 'How do structures of a subject vary together?', (members) => (!members.some((m) => m.subject) || !differ(partsOf(members))) && 'needs subjects and a column part'],
    ['classify-parts', 'Classify by structures', 'Can the group be told from several structures together?', (members) => (!members.some((m) => m.subject) || !differ(partsOf(members)) ? 'needs subjects and a column part' : twoLabels(members))],
    ['neighbours', 'Neighbours', 'Which are nearest to each?'],
    ['train', 'Keep a classifier', 'What label will a new shape have?', twoLabels],
    ['report', 'Report', 'All that was found, as one page'],
];

type Row = api.Member & { name: string };

/** Changes that are not saved yet, by cohort and its version: whoever looks at a shape and comes back finds them. */
const drafts = new Map<string, Map<number, api.Member>>();

function Editor({ cohort, names, reload }: { cohort: api.Cohort; names: Map<string, string>; reload: () => void }) {
    const draft = `${cohort.name} ${cohort.etag}`;
    const [changed, change] = useState<Map<number, api.Member>>(drafts.get(draft) ?? new Map());
    const setChanged = (next: Map<number, api.Member>) => {
        if (next.size) drafts.set(draft, next);
        else drafts.delete(draft);
        change(next);
    };
    const [error, setError] = useState<unknown>();
    const [told, setTold] = useState('');
    const [pasting, setPasting] = useState(false);
    const [text, setText] = useState('');
    const members = cohort.members ?? [];
    const covariates = [...new Set(members.flatMap((m) => Object.keys(m.covariates ?? {})))];
    const rows: Row[] = members.map((m, i) => ({ ...m, ...changed.get(i), name: names.get(m.id) || m.id }));
    const set = (i: number, part: Partial<api.Member>) => {
        const next = new Map(changed);
        next.set(i, { ...members[i], ...next.get(i), ...part });
        setChanged(next);
    };
    const put = async (list: api.Member[]) => {
        setError(undefined);
        try {
            await api.send('put', '/v1/cohorts/{name}/members', { name: cohort.name }, { members: list.map(clean) }, cohort.etag ? { 'If-Match': cohort.etag } : {});
            setChanged(new Map());
            say('The cohort was saved');
            reload();
        } catch (e) {
            setError(e);
        }
    };
    const useTable = (given: string) => {
        const table = parseTable(given);
        const found = match(table, members.map((m) => ({ id: m.id, name: names.get(m.id) || m.id })));
        const by = new Map(found.members.map((m) => [m.id, m]));
        setTold(`${found.members.length} of ${members.length} members matched`
            + (found.rows.length ? `; rows without a member: ${found.rows.slice(0, 10).join(', ')}` : '')
            + (found.files.length ? `; members without a row: ${found.files.slice(0, 10).join(', ')}` : ''));
        if (!found.members.length) return;
        void put(members.map((m) => ({ ...m, ...by.get(m.id), covariates: { ...m.covariates, ...by.get(m.id)?.covariates } })));
        setPasting(false);
    };
    const table = () => save(`${cohort.name}.csv`, csv([
        ['file', 'label', 'subject', 'time', 'side', 'mirror', ...covariates],
        ...rows.map((r) => [r.name, r.label, r.subject, r.time, r.side, r.mirror ? 'true' : 'false', ...covariates.map((c) => r.covariates?.[c] as any)]),
    ]), 'text/csv;charset=utf-8');
    const labels = [...new Set(rows.map((r) => r.label).filter((l) => l))] as string[];
    const cell = (i: number, r: Row, title: string, value: unknown, store: (text: string) => Partial<api.Member>, list?: string) =>
        mayChange() ? (
            <input class="cell" value={value === null || value === undefined ? '' : `${value}`} list={list} aria-label={`${title} of ${r.name}`}
                onChange={(e) => set(i, store(e.currentTarget.value))}
                onKeyDown={(e) => {
                    if (e.key !== 'Enter' && e.key !== 'ArrowDown' && e.key !== 'ArrowUp') return;
                    set(i, store(e.currentTarget.value)); // the last row has no other to go to
                    const row = e.currentTarget.closest('tr')!;
                    const to = e.key === 'ArrowUp' ? row.previousElementSibling : row.nextElementSibling;
                    const column = (e.currentTarget.closest('td') as HTMLTableCellElement).cellIndex;
                    (to as HTMLTableRowElement)?.cells[column]?.querySelector('input')?.focus();
                    e.preventDefault();
                }} />
        ) : <>{value ?? '–'}</>;
    return (
        <section onDragOver={(e) => e.preventDefault()} onDrop={async (e) => {
            e.preventDefault();
            const file = e.dataTransfer?.files[0];
            if (file && mayChange()) useTable(await file.text());
        }}>
            <div class="row tools">
                <h2 class="grow">Members</h2>
                <button onClick={table}>Table as CSV</button>
                {mayChange() && <button onClick={() => setPasting(!pasting)} aria-expanded={pasting}>Paste a table</button>}
                {changed.size > 0 && <>
                    <button onClick={() => setChanged(new Map())}>Undo {plural(changed.size, 'change')}</button>
                    <button class="main" onClick={() => put(rows)}>Save {plural(changed.size, 'change')}</button>
                </>}
            </div>
            {pasting && (
                <div class="card">
                    <label>A table with a column <code>file</code>, copied from a spreadsheet or a CSV; dropping the file on the list does the same
                        <textarea rows={6} value={text} onInput={(e) => setText(e.currentTarget.value)} placeholder={'file\tlabel\tage\nscan01\tcase\t41'} /></label>
                    <button class="main" onClick={() => useTable(text)}>Use it</button>
                </div>
            )}
            {told && <p role="status">{told}</p>}
            {error ? <ProblemBox error={error} again={reload} /> : null}
            <datalist id="labels">{labels.map((l) => <option value={l} />)}</datalist>
            <LongTable label={`Members of ${cohort.name}`} items={rows} keyOf={(r) => `${rows.indexOf(r)}`}
                columns={[{ title: 'Shape' }, { title: 'Label' }, { title: 'Subject' }, { title: 'Side', width: '5rem' }, { title: 'Time', width: '5rem' }, { title: 'Mirror', width: '5rem' }, ...covariates.map((c) => ({ title: c, width: '7rem' }))]}
                row={(r, i) => [
                    <a href={r.id.startsWith('mesh-') ? link('meshes', r.id) : link('shapes', r.id)}>{r.name}</a>,
                    cell(i, r, 'Label', r.label, (t) => ({ label: t || null }), 'labels'),
                    cell(i, r, 'Subject', r.subject, (t) => ({ subject: t || null })),
                    cell(i, r, 'Side', r.side, (t) => ({ side: sideOf(t) })),
                    cell(i, r, 'Time', r.time, (t) => ({ time: t !== '' && Number.isFinite(Number(t)) ? Number(t) : null })),
                    <input type="checkbox" checked={!!r.mirror} disabled={!mayChange()} aria-label={`Mirror ${r.name}`} onChange={(e) => set(i, { mirror: e.currentTarget.checked })} />,
                    ...covariates.map((c) => cell(i, r, c, r.covariates?.[c], (t) => ({
                        covariates: { ...r.covariates, [c]: t === '' ? null : Number.isFinite(Number(t)) ? Number(t) : t },
                    }))),
                ]} />
        </section>
    );
}

/** A member as it is sent: without what is not known. */
function clean(member: api.Member): api.Member {
    const { id, label, subject, side, time, mirror, covariates } = member;
    const known = Object.entries(covariates ?? {}).filter(([, v]) => v !== null && v !== undefined);
    return {
        id, ...(label ? { label } : {}), ...(subject ? { subject } : {}), ...(side ? { side } : {}),
        ...(time !== null && time !== undefined ? { time } : {}), ...(mirror ? { mirror } : {}),
        ...(known.length ? { covariates: Object.fromEntries(known) } : {}),
    };
}

export function CohortPage({ name }: { name: string }) {
    const loaded = useLoad(async () => {
        const cohort = await api.cohort(name);
        return { cohort, names: await namesOf((cohort.members ?? []).map((m) => m.id)) };
    }, [name]);
    const [error, setError] = useState<unknown>();
    const remove = async () => {
        try {
            await api.send('delete', '/v1/cohorts/{name}', { name });
            go('#/cohorts');
        } catch (e) {
            setError(e);
        }
    };
    const download = async () => save(`${name}.zip`, await (await api.request(`/v1/cohorts/${name}/export`)).blob());
    return (
        <Shown of={loaded} page label="the cohort">{({ cohort, names }) => {
            const members = cohort.members ?? [];
            const labels = [...new Set(members.map((m) => m.label).filter((l) => l))];
            return (
                <Page title={cohort.name} actions={<>
                    <button onClick={() => void download().catch(setError)}>Study as zip</button>
                    {mayChange() && <Sure onYes={remove} question={`Delete the cohort ${name}? Its meshes stay.`}>Delete</Sure>}
                </>}>
                    <p class="quiet">{plural(cohort.memberCount, 'member')}{labels.length ? `, labels ${labels.map((l) => `${l} (${members.filter((m) => m.label === l).length})`).join(', ')}` : ', without labels'}</p>
                    {error ? <ProblemBox error={error} /> : null}
                    {mayChange() && (
                        <div class="questions">
                            {[...QUESTIONS].sort((a, b) => +!!a[3]?.(members) - +!!b[3]?.(members)).map(([id, title, text, lacks]) => lacks?.(members)
                                ? <span class="card off" key={id}><strong>{title}</strong><br /><span class="quiet">{lacks(members)}</span></span>
                                : <a class="card" key={id} href={`${link('analyses', id)}?cohort=${name}`}><strong>{title}</strong><br /><span class="quiet">{text}</span></a>)}
                            <a class="card" href={`#/analyses?cohort=${name}`}><strong>More</strong><br /><span class="quiet">every process</span></a>
                        </div>
                    )}
                    <CohortJobs name={name} />
                    <Gallery members={members.map((m) => ({ id: m.id, name: names.get(m.id) || m.id, group: m.label ?? undefined }))} />
                    <Editor cohort={cohort} names={names} reload={loaded.reload} />
                </Page>
            );
        }}</Shown>
    );
}

/** What was asked of this cohort, the last first. */
function CohortJobs({ name }: { name: string }) {
    const recent = useValue(jobs);
    const known = useLoad(() => api.jobs({ limit: 20, cohort: name }), [name, recent.map((j) => j.id + j.status).join()]);
    const mine = known.value?.items ?? [];
    if (!mine.length) return null;
    return (
        <section>
            <h2>Answers</h2>
            <ul class="plain">{mine.map((j) => {
                const live = recent.find((r) => r.id === j.id) ?? j;
                return (
                    <li key={j.id}><a href={link('jobs', j.id)}>{j.name || j.process}</a>{' '}
                        <span class={`state ${live.status}`}>{STATUS[live.status]}{live.status === 'running' ? ` ${Math.round(live.progress)} %` : ''}</span></li>
                );
            })}</ul>
        </section>
    );
}
