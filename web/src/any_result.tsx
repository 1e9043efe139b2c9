// Results of any process, by what their members are: the page of a process that has no view of its own.
import { DataTable } from './charts';
import { Findings } from './findings';
import { t } from './i18n';
import { Linked } from './paths';
import { link } from './router';
import { figure } from './ui';

const isRecord = (v: any, kind: string): boolean => !!v && typeof v === 'object' && typeof v.id === 'string' && v.id.startsWith(kind);
const isScalar = (v: any): boolean => v === null || typeof v !== 'object';
const SHORT = 8;

/** A value that fits into a cell: scalars, short lists, objects of a few of these. */
const fits = (v: any): boolean => isScalar(v) || (Array.isArray(v) ? v.length <= SHORT && v.every(isScalar)
    : Object.keys(v).length <= SHORT && Object.values(v).every((one) => isScalar(one) || (Array.isArray(one) && one.length <= SHORT && one.every(isScalar))));

const words = (name: string): string => name.replace(/([a-z0-9])([A-Z])/g, '$1 $2').toLowerCase();

function textOf(v: any): string {
    if (v === null || v === undefined) return '–';
    if (typeof v === 'number') return figure(v, 5);
    if (typeof v === 'boolean') return v ? t`yes` : t`no`;
    if (Array.isArray(v)) return v.map(textOf).join(', ') || t`none`;
    return typeof v === 'object' ? Object.entries(v).map(([name, one]) => `${words(name)}: ${textOf(one)}`).join('; ') : `${v}`;
}

/** Records of shapes in an object of any depth but two, by what they are called. */
function shapesOf(result: object, depth = 0): { name: string; id: string }[] {
    return Object.entries(result).flatMap(([name, v]: [string, any]) => {
        if (isRecord(v, 'surf-') || isRecord(v, 'mesh-')) return [{ name: v.name || words(name), id: v.id }];
        return v && typeof v === 'object' && depth < 2 && !OWN.has(name) ? shapesOf(v, depth + 1) : [];
    });
}

const OWN = new Set(['inputs', 'warnings', 'numericBuild', 'history', 'registration', 'links', 'model']);
const LEVELS = ['h2', 'h3', 'h4'] as const;
const DEPTH_MAX = LEVELS.length;
const SIDE_MAX = 24;
const ROWS_MAX = 500;

function Part({ name, value, depth }: { name: string; value: any; depth: number }) {
    const Head = LEVELS[Math.min(depth, DEPTH_MAX - 1)];
    const head = <Head>{words(name)}</Head>;
    if (!Array.isArray(value)) return <>{head}<Members of={value} depth={depth + 1} /></>;
    const first = value.find((v) => v !== null);
    if (Array.isArray(first)) {
        const few = value.length <= SIDE_MAX && first.length <= SIDE_MAX && first.every(isScalar);
        return <>{head}{few ? <DataTable rows={[first.map((_: unknown, i: number) => `${i + 1}`), ...value.map((row) => (row ?? []).map((v: any) => (typeof v === 'number' ? v : textOf(v))))]} /> : <p class="quiet">{t`${value.length} by ${first.length} values: they are in the results as JSON.`}</p>}</>;
    }
    if (isScalar(first)) return <>{head}<p class="quiet">{t`${value.length} values, ${value.slice(0, SHORT).map(textOf).join(', ')}, …: they are in the results as JSON.`}</p></>;
    const columns = [...new Set(value.flatMap((row) => Object.keys(row ?? {})))].filter((c) => value.some((row) => row?.[c] !== undefined && row[c] !== null && fits(row[c])));
    return (
        <>{head}
            <DataTable rows={[columns.map(words), ...value.slice(0, ROWS_MAX).map((row) => columns.map((c) => (typeof row?.[c] === 'number' ? row[c] : fits(row?.[c] ?? null) ? textOf(row?.[c]) : '…')))]} />
            {value.length > ROWS_MAX && <p class="quiet">{t`and ${value.length - ROWS_MAX} more.`}</p>}
        </>
    );
}

function Members({ of, depth }: { of: Record<string, any>; depth: number }) {
    const shown = Object.entries(of).filter(([name, v]) => v !== null && v !== undefined && !OWN.has(name) && !isRecord(v, 'surf-') && !isRecord(v, 'mesh-')
        && !(Array.isArray(v) && isRecord(v[0], 'surf-')));
    // Lists that go with the labels are columns of one table.
    const n = Array.isArray(of.labels) ? of.labels.length : 0;
    const beside = n > 0 ? shown.filter(([, v]) => Array.isArray(v) && v.length === n && v.every(isScalar)) : [];
    const rest = shown.filter((one) => !beside.includes(one));
    const short = rest.filter(([, v]) => fits(v));
    return (
        <>
            {short.length > 0 && <dl class="pairs">{short.map(([name, v]) => <><dt>{words(name)}</dt><dd>{textOf(v)}</dd></>)}</dl>}
            {beside.length > 0 && <DataTable rows={[beside.map(([name]) => words(name)), ...of.labels.slice(0, ROWS_MAX).map((_: unknown, i: number) => beside.map(([, v]) => (typeof v[i] === 'number' ? v[i] : textOf(v[i]))))]} />}
            {depth < DEPTH_MAX && rest.filter(([, v]) => !fits(v)).map(([name, v]) => <Part key={name} name={name} value={v} depth={depth} />)}
        </>
    );
}

export function AnyResult({ result }: { result: object }) {
    const shapes = shapesOf(result);
    const { model } = result as { model?: any };
    return (
        <>
            <div class="gallery">{shapes.slice(0, 40).map((s) => (
                <div><Linked id={s.id} title={s.name} /><a class="no-report" href={link(s.id.startsWith('mesh-') ? 'meshes' : 'shapes', s.id)}>{t`Open, download`}</a></div>
            ))}</div>
            {shapes.length > 40 && <p class="quiet">{t`and ${shapes.length - 40} more: they are among the shapes.`}</p>}
            {isRecord(model, 'model-') && <p><a href={link('models', model.id)}>{t`The model`}</a></p>}
            <Findings result={result} />
            <Members of={result} depth={0} />
        </>
    );
}
