// Cohorts: members with labels and covariates, edited as in a spreadsheet, and what can be asked of them.
import { useRef, useState } from 'preact/hooks';
import * as api from './api';
import { namesOf } from './names';
import { fromHere, go, link } from './router';
import { Value, jobs, mayChange, say, useValue } from './state';
import { LongTable, Page, ProblemBox, Shown, Sure, csv, later, plural, save, useLoad, when } from './ui';
import { DropZone, STATUS, Uploads } from './home';
import { t } from './i18n';
import { freeName, match, sideOf, tableOf } from './upload';

const Gallery = later<any>(() => import('./shape').then((m) => m.Gallery));

export function Cohorts() {
    const cohorts = useLoad(() => api.list('cohorts', { limit: 200 }), []);
    return (
        <Page title={t`Cohorts`}>
            <Undelete />
            {mayChange() && <DropZone compact />}
            <Uploads />
            <Shown of={cohorts}>{(page) => page.items.length === 0
                ? <p class="quiet">{t`No cohort yet. Drop meshes with a table, choose some under`} <a href="#/meshes">{t`Meshes`}</a>{t`, or load the example from the`} <a href="#/">{t`start`}</a>.</p>
                : <div class="cards">{page.items.map((c) => (
                    <a class="card" href={link('cohorts', c.name)}><h2>{c.name}</h2><p class="quiet">{plural(c.memberCount, 'member')}, {when(c.created)}</p></a>
                ))}</div>}</Shown>
        </Page>
    );
}

/** Questions that people ask, the process that answers each, and what the cohort lacks for it: nothing or a word. */
type Question = [id: string, title: string, text: string, lacks?: (members: api.Member[]) => string | false];
const differ = (values: unknown[]): boolean => new Set(values.filter((v) => v !== null && v !== undefined && v !== '')).size > 1;
const twoLabels = (members: api.Member[]) => !differ(members.map((m) => m.label)) && t`needs two labels`;
const partsOf = (members: api.Member[]) => members.map((m) => m.covariates?.part);
const QUESTIONS: Question[] = [
    ['pca', t`Mean and components`, t`How do these shapes vary?`],
    ['compare-groups', t`Compare groups`, t`Do two groups differ, and where?`, twoLabels],
    ['classify', t`Classify`, t`Can the group be told from the shape?`, twoLabels],
    ['distances', t`Distances`, t`Which shapes are alike?`],
    ['mean', t`Mean`, t`The shape in the middle`],
    ['evaluate-model', t`Quality`, t`How well does a model describe them?`],
    ['regress', t`Linear model`, t`How does shape depend on covariates?`],
    ['change', t`Change`, t`What happens between two visits of a subject?`, (members) => (!members.some((m) => m.subject) || !differ(members.map((m) => m.time))) && t`needs subjects and two times`],
    ['asymmetry', t`Asymmetry`, t`How do left and right sides differ?`, (members) => (!members.some((m) => m.subject) || !differ(members.map((m) => m.side))) && t`needs subjects and both sides`],
    ['trajectories', t`Trajectories`, t`How do subjects change over time, and who is unlike the others?`, (members) => (!members.some((m) => m.subject) || !differ(members.map((m) => m.time))) && t`needs subjects and times`],
    ['pca-parts', t`Several structures`, t`How do structures of a subject vary together?`, (members) => (!members.some((m) => m.subject) || !differ(partsOf(members))) && t`needs subjects and a column part`],
    ['classify-parts', t`Classify by structures`, t`Can the group be told from several structures together?`, (members) => (!members.some((m) => m.subject) || !differ(partsOf(members)) ? t`needs subjects and a column part` : twoLabels(members))],
    ['neighbours', t`Neighbours`, t`Which are nearest to each?`],
    ['train', t`Keep a classifier`, t`What label will a new shape have?`, twoLabels],
    ['train-parts', t`Keep a classifier by structures`, t`What label will a new subject have, by several structures?`, (members) => (!members.some((m) => m.subject) || !differ(partsOf(members)) ? t`needs subjects and a column part` : twoLabels(members))],
    ['report', t`Report`, t`All that was found, as one page`],
];

type Row = api.Member & { name: string; at: number };

/** A column of the list: what a member has there, and what a text means there. */
interface Field { title: string; kind?: 'label' | 'mirror'; width?: string; value: (r: Row) => any; store: (text: string, member: api.Member) => Partial<api.Member> }
const isNumber = (text: string): boolean => text.trim() !== '' && Number.isFinite(Number(text));
const FIELDS: Field[] = [
    { title: t`Label`, kind: 'label', value: (r) => r.label, store: (text) => ({ label: text || null }) },
    { title: t`Subject`, value: (r) => r.subject, store: (text) => ({ subject: text || null }) },
    { title: t`Side`, width: '5rem', value: (r) => r.side, store: (text) => ({ side: sideOf(text) }) },
    { title: t`Time`, width: '5rem', value: (r) => r.time, store: (text) => ({ time: isNumber(text) ? Number(text) : null }) },
    { title: t`Mirror`, kind: 'mirror', width: '5rem', value: (r) => !!r.mirror, store: (text) => ({ mirror: /^(true|1|yes)$/i.test(text) }) },
];
const covariateField = (name: string): Field => ({
    title: name, width: '7rem', value: (r) => r.covariates?.[name],
    store: (text, member) => ({ covariates: { ...member.covariates, [name]: text === '' ? null : isNumber(text) ? Number(text) : text } }),
});

/** Changes that are not saved yet, by cohort and its version: whoever looks at a shape and comes back finds them. */
interface Draft { changed: Map<number, api.Member>; removed: Set<number>; columns: string[] }
const drafts = new Map<string, Draft>();
const NONE: Draft = { changed: new Map(), removed: new Set(), columns: [] };

function Editor({ cohort, names, reload }: { cohort: api.Cohort; names: Map<string, string>; reload: () => void }) {
    const draft = `${cohort.name} ${cohort.etag}`;
    const [state, change] = useState<Draft>(drafts.get(draft) ?? NONE);
    const { changed, removed, columns } = state;
    const keep = (next: Draft) => {
        if (next.changed.size || next.removed.size || next.columns.length) drafts.set(draft, next);
        else drafts.delete(draft);
        change(next);
    };
    const edits = new Set([...changed.keys(), ...removed]).size;
    const [error, setError] = useState<unknown>();
    const [told, setTold] = useState('');
    const [pasting, setPasting] = useState(false);
    const [text, setText] = useState('');
    const members = cohort.members ?? [];
    const covariates = [...new Set([...members.flatMap((m) => Object.keys(m.covariates ?? {})), ...columns])];
    const all = members.map((m, i) => ({ ...m, ...changed.get(i), name: names.get(m.id) || m.id, at: i }));
    const rows: Row[] = all.filter((r) => !removed.has(r.at));
    const set = (i: number, part: Partial<api.Member>) => {
        const next = new Map(changed);
        next.set(i, { ...members[i], ...next.get(i), ...part });
        keep({ ...state, changed: next });
    };
    const [column, setColumn] = useState('');
    const addColumn = (event: Event) => {
        event.preventDefault();
        const name = column.trim();
        if (name && !covariates.includes(name)) keep({ ...state, columns: [...columns, name] });
        setColumn('');
    };
    const put = async (list: api.Member[]) => {
        setError(undefined);
        try {
            await api.send('put', '/v1/cohorts/{name}/members', { name: cohort.name }, { members: list.map(clean) }, cohort.etag ? { 'If-Match': cohort.etag } : {});
            keep(NONE);
            say(t`The cohort was saved`);
            reload();
        } catch (e) {
            setError(e);
        }
    };
    const useTable = (given: string) => {
        setError(undefined);
        setTold('');
        let table;
        try {
            table = tableOf(given);
        } catch (e) {
            return setError(e);
        }
        const found = match(table, members.map((m) => ({ id: m.id, name: names.get(m.id) || m.id })));
        const by = new Map(found.members.map((m) => [m.id, m]));
        setTold(t`${found.members.length} of ${members.length} members matched`
            + (found.rows.length ? t`; rows without a member: ${found.rows.slice(0, 10).join(', ')}` : '')
            + (found.files.length ? t`; members without a row: ${found.files.slice(0, 10).join(', ')}` : ''));
        if (!found.members.length) return;
        void put(members.map((m) => ({ ...m, ...by.get(m.id), covariates: { ...m.covariates, ...by.get(m.id)?.covariates } })));
        setPasting(false);
    };
    const table = () => save(`${cohort.name}.csv`, csv([
        ['file', 'label', 'subject', 'time', 'side', 'mirror', ...covariates],
        ...rows.map((r) => [r.name, r.label, r.subject, r.time, r.side, r.mirror ? 'true' : 'false', ...covariates.map((c) => r.covariates?.[c] as any)]),
    ]), 'text/csv;charset=utf-8');
    const labels = [...new Set(rows.map((r) => r.label).filter((l) => l))] as string[];
    const fields: Field[] = [...FIELDS, ...covariates.map(covariateField)];
    /** What was copied from a spreadsheet is put from a cell on, to the right and down. */
    const paste = (event: ClipboardEvent, list: Row[], from: number, column: number) => {
        const lines = (event.clipboardData?.getData('text/plain') ?? '').replace(/\r\n?/g, '\n').replace(/\n$/, '').split('\n').map((line) => line.split('\t'));
        if (lines.length === 1 && lines[0].length === 1) return; // into one cell, as anywhere
        event.preventDefault();
        const next = new Map(changed);
        list.slice(from, from + lines.length).forEach((r, i) => {
            const member = { ...members[r.at], ...next.get(r.at) };
            fields.slice(column, column + lines[i].length).forEach((field, k) => Object.assign(member, field.store(lines[i][k].trim(), member)));
            next.set(r.at, member);
        });
        keep({ ...state, changed: next });
        const [down, right] = [Math.min(lines.length, list.length - from), Math.min(lines[0].length, fields.length - column)];
        setTold(t`${down} by ${plural(right, 'cell')} pasted${lines.length > down || lines[0].length > right ? t`; the rest had no place` : ''}. Save them, or undo.`);
    };
    const cell = (r: Row, index: number, list: Row[], field: Field, column: number) => {
        const value = field.value(r);
        if (field.kind === 'mirror') return <input type="checkbox" checked={!!value} disabled={!mayChange()} aria-label={t`Mirror ${r.name}`} onChange={(e) => set(r.at, { mirror: e.currentTarget.checked })} />;
        return mayChange() ? (
            <input class="cell" value={value === null || value === undefined ? '' : `${value}`} list={field.kind === 'label' ? 'labels' : undefined} aria-label={t`${field.title} of ${r.name}`}
                onPaste={(e) => paste(e, list, index, column)}
                onChange={(e) => set(r.at, field.store(e.currentTarget.value, r))}
                onKeyDown={(e) => {
                    if (e.key !== 'Enter' && e.key !== 'ArrowDown' && e.key !== 'ArrowUp') return;
                    set(r.at, field.store(e.currentTarget.value, r)); // the last row has no other to go to
                    const row = e.currentTarget.closest('tr')!;
                    const to = e.key === 'ArrowUp' ? row.previousElementSibling : row.nextElementSibling;
                    const place = (e.currentTarget.closest('td') as HTMLTableCellElement).cellIndex;
                    (to as HTMLTableRowElement)?.cells[place]?.querySelector('input')?.focus();
                    e.preventDefault();
                }} />
        ) : <>{value ?? '–'}</>;
    };
    return (
        <section onDragOver={(e) => e.preventDefault()} onDrop={async (e) => {
            e.preventDefault();
            const file = e.dataTransfer?.files[0];
            if (file && mayChange()) useTable(await file.text());
        }}>
            <div class="row tools">
                <h2 class="grow">{t`Members`}</h2>
                <button onClick={table}>{t`Table as CSV`}</button>
                {mayChange() && <button onClick={() => setPasting(!pasting)} aria-expanded={pasting}>{t`Paste a table`}</button>}
                {edits > 0 && <>
                    <button onClick={() => keep({ ...NONE, columns })}>{t`Undo ${plural(edits, 'change')}`}</button>
                    <button class="main" disabled={rows.length === 0} onClick={() => put(rows)}>{t`Save ${plural(edits, 'change')}`}</button>
                </>}
            </div>
            {mayChange() && (
                <form class="row tools" onSubmit={addColumn}>
                    <label>{t`New column`} <input type="text" value={column} maxLength={127} placeholder={t`age`} onInput={(e) => setColumn(e.currentTarget.value)} /></label>
                    <button disabled={!column.trim() || covariates.includes(column.trim())}>{t`Add the column`}</button>
                    <span class="quiet">{t`A column is a covariate; it is kept with its first value. Cells of a spreadsheet can be pasted into the list. More members: choose them under`} <a href="#/meshes">{t`Meshes`}</a>.</span>
                </form>
            )}
            {removed.size > 0 && <p role="status">{t`${plural(removed.size, 'member')} will leave the cohort when it is saved; the meshes stay.`}</p>}
            {pasting && (
                <div class="card">
                    <label>{t`A table with a column`} <code>file</code>{t`, copied from a spreadsheet or a CSV; dropping the file on the list does the same`}
                        <textarea rows={6} value={text} onInput={(e) => setText(e.currentTarget.value)} placeholder={t`file	label	age
scan01	case	41`} /></label>
                    <button class="main" onClick={() => useTable(text)}>{t`Use it`}</button>
                </div>
            )}
            {told && <p role="status">{told}</p>}
            {error ? <ProblemBox error={error} again={reload} /> : null}
            <datalist id="labels">{labels.map((l) => <option value={l} />)}</datalist>
            <LongTable label={t`Members of ${cohort.name}`} items={rows} keyOf={(r) => `${r.at}`}
                columns={[{ title: t`Shape`, by: (r) => r.name }, ...fields.map((f) => ({ title: f.title, width: f.width, by: f.kind === 'mirror' ? undefined : f.value })),
                    ...(mayChange() ? [{ title: t`Remove`, hidden: true, width: '7rem' }] : [])]}
                row={(r, index, list) => [
                    <a href={r.id.startsWith('mesh-') ? link('meshes', r.id) : link('shapes', r.id)}>{r.name}</a>,
                    ...fields.map((field, column) => cell(r, index, list, field, column)),
                    ...(mayChange() ? [<button aria-label={t`Remove ${r.name} from the cohort`} onClick={() => keep({ ...state, removed: new Set([...removed, r.at]) })}>{t`Remove`}</button>] : []),
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

/** Another name for a cohort. */
function Rename({ name, etag }: { name: string; etag?: string }) {
    const dialog = useRef<HTMLDialogElement>(null);
    const [text, setText] = useState(name);
    const [error, setError] = useState<unknown>();
    const rename = async (event: Event) => {
        event.preventDefault();
        setError(undefined);
        const wanted = text.trim();
        try {
            if (wanted !== name) await api.send('patch', '/v1/cohorts/{name}', { name }, { name: wanted }, etag ? { 'If-Match': etag } : {});
            dialog.current!.close();
            if (wanted !== name) go(link('cohorts', wanted));
        } catch (e) {
            setError(e);
        }
    };
    return (
        <>
            <button onClick={() => { setText(name); setError(undefined); dialog.current!.showModal(); }}>{t`Rename`}</button>
            <dialog ref={dialog} aria-label={t`Rename the cohort ${name}`}>
                <form onSubmit={rename}>
                    <label>{t`Name`} <input type="text" value={text} required maxLength={100} pattern="[A-Za-z0-9._\-]+" title={t`Letters, digits, dots, dashes and underscores`} onInput={(e) => setText(e.currentTarget.value)} /></label>
                    <p class="help">{t`Letters, digits, dots, dashes and underscores. Results that were made keep the name that they were made with.`}</p>
                    {error ? <ProblemBox error={error} /> : null}
                    <div class="actions"><button class="main">{t`Rename`}</button><button type="button" onClick={() => dialog.current!.close()}>{t`Keep`}</button></div>
                </form>
            </dialog>
        </>
    );
}

/** The cohort that was deleted last, while the page is open: it can be made again, as its meshes stay. */
const deleted = new Value<{ name: string; members: api.Member[] } | null>(null);

function Undelete() {
    const gone = useValue(deleted);
    const [error, setError] = useState<unknown>();
    if (!gone) return null;
    const back = async () => {
        const onward = fromHere();
        try {
            const name = await freeName(gone.name);
            await api.send('post', '/v1/cohorts', {}, { name, members: gone.members.map(clean) });
            deleted.set(null);
            onward(link('cohorts', name));
        } catch (e) {
            setError(e);
        }
    };
    return (
        <section class="card row" aria-label={t`Deleted`}>
            <span class="grow">{t`The cohort ${gone.name} was deleted.`}</span>
            <button onClick={() => void back()}>{t`Undo`}</button>
            <button aria-label={t`Close the word of what was deleted`} onClick={() => deleted.set(null)}>{t`Close`}</button>
            {error ? <ProblemBox error={error} /> : null}
        </section>
    );
}

export function CohortPage({ name }: { name: string }) {
    const loaded = useLoad(async () => {
        const cohort = await api.cohort(name);
        return { cohort, names: await namesOf((cohort.members ?? []).map((m) => m.id)) };
    }, [name]);
    const [error, setError] = useState<unknown>();
    const remove = async (members: api.Member[]) => {
        const onward = fromHere();
        try {
            await api.send('delete', '/v1/cohorts/{name}', { name });
            deleted.set({ name, members });
            onward('#/cohorts');
        } catch (e) {
            setError(e);
        }
    };
    const download = async () => save(`${name}.zip`, await (await api.request(`/v1/cohorts/${name}/export`)).blob());
    return (
        <Shown of={loaded} page label={t`the cohort`}>{({ cohort, names }) => {
            const members = cohort.members ?? [];
            const labels = [...new Set(members.map((m) => m.label).filter((l) => l))];
            return (
                <Page title={cohort.name} actions={<>
                    <button onClick={() => void download().catch(setError)}>{t`Study as zip`}</button>
                    {mayChange() && <Rename name={name} etag={cohort.etag} />}
                    {mayChange() && <Sure onYes={() => void remove(members)} question={t`Delete the cohort ${name}? Its meshes and its results stay.`}>{t`Delete`}</Sure>}
                </>}>
                    <p class="quiet">{plural(cohort.memberCount, 'member')}{labels.length ? t`, labels ${labels.map((l) => `${l} (${members.filter((m) => m.label === l).length})`).join(', ')}` : t`, without labels`}</p>
                    {error ? <ProblemBox error={error} /> : null}
                    {mayChange() && (
                        <div class="questions">
                            {[...QUESTIONS].sort((a, b) => +!!a[3]?.(members) - +!!b[3]?.(members)).map(([id, title, text, lacks]) => lacks?.(members)
                                ? <span class="card off" key={id}><strong>{title}</strong><br /><span class="quiet">{lacks(members)}</span></span>
                                : <a class="card" key={id} href={`${link('analyses', id)}?cohort=${name}`}><strong>{title}</strong><br /><span class="quiet">{text}</span></a>)}
                            <a class="card" href={`#/analyses?cohort=${name}`}><strong>{t`More`}</strong><br /><span class="quiet">{t`every process`}</span></a>
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
            <h2>{t`Answers`}</h2>
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
