// Files into the service: meshes four at a time, archives as they are, a table matched on the names of the files. What
// has been sent, and what was refused and why, is a list that pages show.
import * as api from './api';
import { t } from './i18n';
import { parseTable } from './table';
import type { Table } from './table';
import { Value, say } from './state';

export interface Sent {
    name: string; size: number; part: number; state: 'waits' | 'goes' | 'done' | 'refused';
    id?: string; note?: string;
    /** It is here, and cannot be analysed. */
    doubtful?: boolean;
}
export interface Batch {
    files: Sent[]; running: boolean; cohort?: string; volumes: string[]; unmatched: { rows: string[]; files: string[] };
    error?: unknown; stop: () => void;
}

export const batch = new Value<Batch | null>(null);

const TABLE = /\.(csv|tsv|txt)$/i;
const ARCHIVE = /\.(zip|tar|tgz|tar\.gz)$/i;
const VOLUME = /\.(nii|nii\.gz|nrrd)$/i;
/** What people have beside meshes, and what is to be done with it. */
const OTHERS: [RegExp, string][] = [
    [/\.(xlsx?|ods|numbers)$/i, t`a spreadsheet: save its table as CSV, and drop that`],
    [/\.(dcm|ima)$/i, t`an image in DICOM: segment it, and drop the segmentation as NIfTI or NRRD`],
    [/\.(pdf|docx?|html?)$/i, t`a document, not a mesh`],
];
const AT_ONCE = 4;

/** Files of what was dropped, with those in folders. */
export async function filesOf(data: DataTransfer): Promise<File[]> {
    const entries = [...data.items].map((item) => item.webkitGetAsEntry?.()).filter((e) => e) as FileSystemEntry[];
    if (!entries.length) return [...data.files];
    const files: File[] = [];
    const walk = async (entry: FileSystemEntry): Promise<void> => {
        if (entry.isFile) {
            files.push(await new Promise<File>((yes, no) => (entry as FileSystemFileEntry).file(yes, no)));
            return;
        }
        const reader = (entry as FileSystemDirectoryEntry).createReader();
        for (;;) {
            const some = await new Promise<FileSystemEntry[]>((yes, no) => reader.readEntries(yes, no));
            if (!some.length) return;
            for (const one of some) await walk(one);
        }
    };
    for (const entry of entries) await walk(entry);
    return files.filter((file) => !file.name.startsWith('.'));
}

/** A name that a cohort can have. */
export const cohortName = (text: string): string =>
    text.replace(/\.(zip|tar|tgz|tar\.gz|csv|tsv|txt)$/i, '').replace(/[^A-Za-z0-9._-]+/g, '-').slice(0, 100) || 'study';

/** Names of tables that say nothing of the study: it is called by its folder then, if that is known. */
const GENERIC = /^(labels?|data|table|members|groups?|covariates|participants|subjects)$/i;

function studyName(table: File): string {
    const name = cohortName(table.name);
    return GENERIC.test(name) ? cohortName(table.webkitRelativePath?.split('/').at(-2) ?? 'study') : name;
}

const stem = (name: string): string => name.replace(/^.*[/\\]/, '').replace(/\.gz$/i, '').replace(/\.[^.]*$/, '').toLowerCase();

/** The column that names meshes: the first, where none is called so. */
const keyOf = (table: Table): number => Math.max(0, table.columns.findIndex((c) => /^(file|filename|name|mesh|id)$/i.test(c)));

/** Members of a cohort from a table, with what of either side has no partner. */
export function match(table: Table, meshes: { name: string; id: string }[]): {
    members: api.Member[]; rows: string[]; files: string[];
} {
    const byName = new Map<string, string>();
    for (const mesh of meshes) {
        byName.set(mesh.name.toLowerCase(), mesh.id);
        byName.set(stem(mesh.name), mesh.id);
    }
    const key = keyOf(table);
    const used = new Set<string>();
    const members: api.Member[] = [];
    const rows: string[] = [];
    for (const row of table.rows) {
        const id = byName.get(row[key].toLowerCase()) ?? byName.get(stem(row[key]));
        if (!id) {
            rows.push(row[key]);
            continue;
        }
        used.add(id);
        members.push(memberOf(table.columns, row, key, id));
    }
    return { members, rows, files: meshes.filter((m) => !used.has(m.id)).map((m) => m.name) };
}

const SIDES: Record<string, 'left' | 'right'> = { l: 'left', lh: 'left', left: 'left', r: 'right', rh: 'right', right: 'right' };

/** The side that a text names, or null. */
export const sideOf = (text: string): 'left' | 'right' | null => SIDES[text.trim().toLowerCase()] ?? null;

function memberOf(columns: string[], row: string[], key: number, id: string): api.Member {
    const member: api.Member = { id, covariates: {} };
    const labelled = columns.some((c) => /^label$/i.test(c)); // "group" is one more covariate then
    columns.forEach((column, i) => {
        const text = row[i] ?? '';
        if (i === key || text === '' || /^(na|n\/a|nan)$/i.test(text)) return;
        const name = column.toLowerCase();
        if (name === 'label' || (name === 'group' && !labelled)) member.label = text;
        else if (name === 'subject' || name === 'participant_id') member.subject = text;
        else if (name === 'side' && sideOf(text)) member.side = sideOf(text);
        else if (name === 'time') member.time = Number(text);
        else if (name === 'mirror') member.mirror = /^(true|1|yes)$/i.test(text);
        else member.covariates![column] = /^(true|false)$/i.test(text) ? /true/i.test(text)
            : Number.isFinite(Number(text)) ? Number(text) : text;
    });
    return member;
}

export async function sendFiles(files: File[]): Promise<void> {
    if (!files.length || batch.get()?.running) return;
    const stop = new AbortController();
    let state: Batch = {
        files: files.map((f) => ({ name: f.name, size: f.size, part: 0, state: 'waits' })),
        running: true, volumes: [], unmatched: { rows: [], files: [] }, stop: () => stop.abort(),
    };
    const change = (part: Partial<Batch>) => batch.set((state = { ...state, ...part }));
    const mark = (i: number, part: Partial<Sent>) =>
        change({ files: state.files.map((f, k) => (k === i ? { ...f, ...part } : f)) });
    change({});

    const work = files.map((file, i) => ({ file, i })).filter(({ file }) => !TABLE.test(file.name));
    const meshes: { name: string; id: string }[] = [];
    const worker = async () => {
        for (let next = work.shift(); next && !stop.signal.aborted; next = work.shift()) {
            const { file, i } = next;
            mark(i, { state: 'goes' });
            try {
                const told = (part: number) => {
                    if (part - state.files[i].part > 0.05 || part === 1) mark(i, { part });
                };
                await sendOne(file, told, stop.signal, meshes, (part) => change(part), (note, id, doubtful) => mark(i, { note, id, doubtful }), state);
                mark(i, { state: 'done', part: 1 });
            } catch (error) {
                // What callers of the API can do about it is nothing that can be done here.
                mark(i, { state: 'refused', note: (error as Error).message.replace(/; name the format by \?format= .*$/, '.') });
            }
        }
    };
    await Promise.all(Array.from({ length: AT_ONCE }, worker));
    // A folder has notes beside its table: each file is tried, and it is an error where none of them fits.
    let first: unknown;
    for (const [i, file] of files.entries()) {
        if (!TABLE.test(file.name)) continue;
        try {
            await useTable(file, meshes, change);
            mark(i, { state: 'done', part: 1 });
        } catch (error) {
            first ??= error;
            mark(i, { state: 'refused', note: (error as Error).message });
        }
    }
    if (first && !state.cohort) change({ error: first });
    change({ running: false });
    say(t`${state.files.filter((f) => f.state === 'done').length} of ${files.length} files are there`);
}

async function sendOne(file: File, told: (part: number) => void, signal: AbortSignal,
    meshes: { name: string; id: string }[], change: (part: Partial<Batch>) => void,
    mark: (note: string, id?: string, doubtful?: boolean) => void, state: Batch): Promise<void> {
    const other = OTHERS.find(([name]) => name.test(file.name));
    if (other) throw new Error(other[1]);
    if (ARCHIVE.test(file.name)) {
        const answer = await api.upload<api.Imported>(`/v1/imports?partial=true&cohort=${encodeURIComponent(cohortName(file.name))}`,
            file, 'application/octet-stream', told, signal);
        const refused = answer.refused.length;
        mark(t`${answer.meshes.length} meshes${refused ? t`, ${refused} refused: ${answer.refused[0].file}: ${answer.refused[0].detail}` : ''}`);
        if (answer.cohort?.name) change({ cohort: answer.cohort.name });
        return;
    }
    const name = encodeURIComponent(file.name.replace(/\.gz$/i, '').replace(/\.[^.]*$/, '').slice(0, 255));
    if (VOLUME.test(file.name)) {
        const volume = await api.upload<api.Volume>(`/v1/volumes?name=${name}`, file, 'application/octet-stream', told, signal);
        mark(t`${volume.labels?.length ?? 0} labels`, volume.id);
        change({ volumes: [...state.volumes, volume.id] });
        return;
    }
    const mesh = await api.upload<api.Mesh>(`/v1/meshes?name=${name}`, file, 'application/octet-stream', told, signal);
    meshes.push({ name: file.name, id: mesh.id });
    mark(mesh.report.analysable ? '' : t`cannot be analysed: ${mesh.report.problems[0]?.detail ?? ''}`, mesh.id, !mesh.report.analysable);
}

/** What is wrong with a table, for people. */
const wrongTable = (detail: string): api.Failure => new api.Failure({ status: 0, code: 'table', title: t`The table does not fit`, detail });

/** The table of a text; fails with what is wrong with it. */
export function tableOf(text: string): Table {
    try {
        const table = parseTable(text);
        if (table.rows.length) return table;
    } catch (error) {
        throw wrongTable((error as Error).message);
    }
    throw wrongTable(text.trim() ? t`It has one line only: the first names the columns, and each after it is a member.` : t`It is empty.`);
}

const some = (names: string[]): string => names.slice(0, 3).join(', ') + (names.length > 3 ? ', …' : '');

/** Why no row of a table has a mesh. */
function lacking(name: string, table: Table, meshes: string[]): string {
    const key = keyOf(table);
    return t`No row of ${name} names a mesh that is here. Names were read from its column ${table.columns[key]}: ${some(table.rows.map((r) => r[key]))}. `
        + (meshes.length ? t`Meshes are called ${some(meshes)}.` : t`There are no meshes yet: send them with the table, or before.`);
}

async function useTable(file: File, meshes: { name: string; id: string }[],
    change: (part: Partial<Batch>) => void): Promise<void> {
    const table = tableOf(await file.text());
    let known = meshes;
    if (!known.length) {
        await api.listAll('meshes', (items) => { known = items; }, () => false);
    }
    const { members, rows, files } = match(table, known);
    if (!members.length) throw wrongTable(lacking(file.name, table, known.map((m) => m.name)));
    change({ unmatched: { rows, files: meshes.length ? files : [] } });
    const name = await freeName(studyName(file));
    await api.send('post', '/v1/cohorts', {}, { name, members });
    change({ cohort: name });
}

/** The name, or with a number where a cohort has it. */
export async function freeName(wanted: string): Promise<string> {
    for (let n = 1; ; n++) {
        const name = n === 1 ? wanted : `${wanted.slice(0, 96)}-${n}`;
        try {
            await api.get('/v1/cohorts/{name}', { name });
        } catch (error) {
            if (error instanceof api.Failure && error.problem.status === 404) return name;
            throw error;
        }
    }
}

/** The nuclei that come with the service: a cohort, and three analyses of it. */
export async function loadExample(told: (part: number) => void): Promise<string> {
    const form = new FormData();
    const labels = await (await fetch('example/labels.csv')).text();
    const names = parseTable(labels).rows.map((row) => row[0]);
    form.append('file', new Blob([labels]), 'labels.csv');
    let n = 0;
    for (const name of names) {
        form.append('file', await (await fetch(`example/${encodeURIComponent(name)}`)).blob(), name);
        told(++n / names.length / 2);
    }
    const cohort = await freeName('example');
    await api.upload(`/v1/imports?cohort=${cohort}`, form, '', (part) => told(0.5 + part / 2));
    const start = (process: string, name: string, inputs: object) =>
        api.execute(process, { cohort, lmax: 15, ...inputs }, name);
    await start('pca', 'Mean and components of the example', {});
    await start('compare-groups', 'Left against right', { permutations: 999 });
    await start('classify', 'Left or right?', { method: ['srnf-nn', 'spharm-pdm'] });
    return cohort;
}
