// The program of a report: draws its charts and its shapes from the data in it. Part of report.html, the frame that the
// service and the dashboard fill.
import { render } from 'preact';
import { useEffect, useMemo, useRef, useState } from 'preact/hooks';
import { Findings } from './findings';
import { GROUPS } from './colours';
import { between, blend, boundsOf, copyOf, normalsOf } from './geometry';
import type { Field, Surface3 } from './glb';
import { ColourBar, mapOf, nameOfMap, paintedBy } from './maps';
import { able, draw, onTurn, rotate, turnTo } from './report_stage';
import { axesOf, commonOf, linesOf, middlesOf, movePart, placesOf, sizesOf, textOfPoint } from './series';
import type { Frames, Line } from './series';
import { figure, save } from './text';

/** Numbers in base64: positions of 16 bits in parts of the radius, maps of 16 bits from low to high, colours of 8. */
interface Packed {
    list: number; centre: number[]; radius: number; positions: string; colours?: string;
    maps?: { name: string; unit: string; meaning: string; low: number; high: number; values: string }[];
}
/** Of rows: the surfaces of a list of a section's results, -1 where one is missing. */
interface ViewOf { kind?: 'mode' | 'path' | 'rows'; shapes: number[]; texts?: string[]; section?: number; list?: string }
interface Data {
    turn?: number[]; lists: { bits: 16 | 32; data: string }[]; shapes: Packed[]; views: ViewOf[];
    sections: { process: string; results: any }[];
}
interface Shape extends Surface3 { colours?: Float32Array }

const raw = (text: string): ArrayBuffer => Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer;
const linear = (c: number): number => (c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4);
const BONE = [0.784, 0.69, 0.565].map(linear);

let data: Data;
const lists = new Map<number, Uint32Array>();
const shapes = new Map<number, Shape>();

function listAt(i: number): Uint32Array {
    let list = lists.get(i);
    if (!list) {
        const { bits, data: text } = data.lists[i];
        list = bits === 16 ? Uint32Array.from(new Uint16Array(raw(text))) : new Uint32Array(raw(text));
        lists.set(i, list);
    }
    return list;
}

function shapeAt(i: number): Shape {
    let shape = shapes.get(i);
    if (!shape) {
        const packed = data.shapes[i];
        const positions = Float32Array.from(new Int16Array(raw(packed.positions)), (v, k) => packed.centre[k % 3] + (packed.radius * v) / 32767);
        const fields: Field[] = (packed.maps ?? []).map(({ values, ...map }) => ({
            ...map, values: Float32Array.from(new Uint16Array(raw(values)), (v) => map.low + (v / 65535) * (map.high - map.low)),
        }));
        shape = { positions, normals: new Float32Array(positions.length), indices: listAt(packed.list), fields };
        if (packed.colours) shape.colours = Float32Array.from(new Uint8Array(raw(packed.colours)), (v) => linear(v / 255));
        normalsOf(shape);
        shapes.set(i, shape);
    }
    return shape;
}

/** Shares of the shapes of a view at a place between them: cubic where there are enough, as along a component. */
export function shares(n: number, at: number, kind?: string): [number, number][] {
    if (kind === 'mode') return between(Array.from({ length: n }, (_, i) => i), at);
    const first = Math.max(0, Math.min(n - 2, Math.floor(at)));
    return n === 1 ? [[0, 1]] : [[first, 1 - (at - first)], [first + 1, at - first]];
}

const isP = (field: Field): boolean => /significance|fdr|pointwiseP/i.test(field.name);

/** A shape that turns with the others, and a picture of it to take away. */
function Turning({ solid, colours, mapped, bounds, label, version }: {
    solid: Surface3; colours: Float32Array; mapped: boolean; bounds: { centre: number[]; radius: number }; label: string; version: number;
}) {
    const canvas = useRef<HTMLCanvasElement>(null);
    const paint = useRef(() => {});
    paint.current = () => canvas.current && draw(canvas.current, solid, colours, mapped, bounds.centre, bounds.radius);
    useEffect(() => {
        const watch = new ResizeObserver(() => {
            const c = canvas.current!;
            const ratio = Math.min(2, devicePixelRatio || 1);
            c.width = Math.round(c.clientWidth * ratio);
            c.height = Math.round(c.clientHeight * ratio);
            paint.current();
        });
        watch.observe(canvas.current!);
        const leave = onTurn(() => paint.current());
        return () => {
            watch.disconnect();
            leave();
        };
    }, []);
    useEffect(() => paint.current(), [solid, colours, version]);
    const hold = useRef<[number, number] | null>(null);
    const KEYS: Record<string, [number, number]> = { ArrowLeft: [0, -0.15], ArrowRight: [0, 0.15], ArrowUp: [-0.15, 0], ArrowDown: [0.15, 0] };
    return (
        <>
            <canvas ref={canvas} class="view" tabIndex={0} role="img" aria-label={`${label}. Drag it or use the arrows to turn it.`}
                onPointerDown={(e) => { hold.current = [e.clientX, e.clientY]; e.currentTarget.setPointerCapture(e.pointerId); }}
                onPointerUp={() => { hold.current = null; }} onPointerCancel={() => { hold.current = null; }}
                onPointerMove={(e) => {
                    if (!hold.current) return;
                    rotate((e.clientY - hold.current[1]) / 120, (e.clientX - hold.current[0]) / 120);
                    hold.current = [e.clientX, e.clientY];
                }}
                onKeyDown={(e) => {
                    if (!KEYS[e.key]) return;
                    rotate(...KEYS[e.key]);
                    e.preventDefault();
                }} />
            <button class="quiet" onClick={() => canvas.current!.toBlob((blob) => blob && save('shape.png', blob))} aria-label={`${label} as PNG`}>PNG</button>
        </>
    );
}

const plain = (shape: Surface3): Float32Array => Float32Array.from(shape.positions, (_, i) => BONE[i % 3]);

function View({ view, label }: { view: ViewOf; label: string }) {
    const all = useMemo(() => view.shapes.map(shapeAt), [view]);
    const bounds = useMemo(() => boundsOf(all), [all]);
    const [at, setAt] = useState(view.kind === 'mode' ? (all.length - 1) / 2 : 0);
    const [name, setName] = useState((all[0].fields.find((f) => f.name === 'normalEffect') ?? all[0].fields[0])?.name ?? '');
    const [threshold, setThreshold] = useState(0.05);
    const [version, setVersion] = useState(0);
    const moving = useMemo(() => ({ ...copyOf(all[0]), fields: [] }), [all]);
    const field = all[0].fields.find((f) => f.name === name);
    const p = all[0].fields.find((f) => f.name === 'significance') ?? all[0].fields.find(isP);
    const any = !!p && p.low <= threshold;
    const map = field && { ...mapOf(field), ...(field === p && any ? { high: threshold || 1 } : {}), keep: p && ((_: number, vertex: number) => p.values[vertex] <= threshold) };
    const colours = useMemo(() => (map ? paintedBy(map) : all[0].colours ?? plain(all[0])), [all, name, threshold]);
    useEffect(() => {
        blend(moving, all, shares(all.length, at, view.kind));
        setVersion((v) => v + 1);
    }, [at, all]);
    const here = view.texts?.[Math.round(at)];
    return (
        <>
            <Turning solid={moving} colours={colours} mapped={!!(map || all[0].colours)} bounds={bounds} version={version} label={`${label}${here ? `, ${here}` : ''}`} />
            {all.length > 1 && (
                <label class="row">{here} <input type="range" min={0} max={all.length - 1} step={0.02} value={at} aria-label={`${label}: where along it`} onInput={(e) => setAt(+e.currentTarget.value)} /></label>
            )}
            {all[0].fields.length > 0 && (
                <div class="row">
                    <label>Map <select value={name} onChange={(e) => setName(e.currentTarget.value)}>
                        <option value="">none</option>{all[0].fields.map((f) => <option value={f.name}>{nameOfMap(f.name)}</option>)}
                    </select></label>
                    {p && map && <label>grey where p exceeds <input type="number" min={0} max={1} step={0.01} value={threshold} onInput={(e) => setThreshold(+e.currentTarget.value)} /></label>}
                </div>
            )}
            {map && <ColourBar map={map} threshold={field === p && !any ? threshold : undefined} />}
            {field?.meaning && <p class="quiet">{field.meaning}</p>}
            {p && map && !any && <p role="status">No point is significant: the least p is {figure(p.low)}.</p>}
        </>
    );
}

// ---- Lists whose rows are seen together ------------------------------------------------------------------------------

/** Predictions of one line, at a place along it. */
function Predicted({ line, all, at, axis, map }: { line: Line; all: Surface3[]; at: number; axis: string; map: string }) {
    const own = useMemo(() => line.members.map((i) => all[i]), [line]);
    const moving = useMemo(() => copyOf(own[0]), [own]);
    const bounds = useMemo(() => boundsOf(all), [all]);
    const [version, setVersion] = useState(0);
    useEffect(() => {
        blend(moving, own, between(line.places, at));
        setVersion((v) => v + 1);
    }, [at, moving]);
    const field = moving.fields.find((f) => f.name === map);
    const range = all.flatMap((s) => s.fields.filter((f) => f.name === map));
    const shown = field && mapOf({ ...field, low: Math.min(...range.map((f) => f.low)), high: Math.max(...range.map((f) => f.high)) });
    const colours = useMemo(() => (shown ? paintedBy(shown) : plain(moving)), [map, version]);
    const text = `${line.text ? `${line.text}, ` : ''}${axis} ${figure(at)}`;
    return (
        <div class="one">
            <Turning solid={moving} colours={colours} mapped={!!shown} bounds={bounds} version={version} label={`Predicted shape, ${text}`} />
            <p class="quiet">{text}</p>
            {shown && <ColourBar map={shown} />}
        </div>
    );
}

function Predictions({ view, rows }: { view: ViewOf; rows: any[] }) {
    const kept = useMemo(() => rows.map((row, i) => ({ at: row.at, shape: view.shapes[i] })).filter((row) => row.shape >= 0), [view]);
    const all = useMemo(() => kept.map((row) => shapeAt(row.shape)), [kept]);
    const points = kept.map((row) => row.at);
    const axis = axesOf(points)[0];
    const lines = useMemo(() => (axis ? linesOf(points, axis) : []), [kept]);
    const places = lines.flatMap((l) => l.places);
    const [at, setAt] = useState(Math.min(...places));
    const [map, setMap] = useState('');
    if (!axis) return <View view={{ kind: 'path', shapes: kept.map((row) => row.shape), texts: points.map(textOfPoint) }} label="Predicted shapes" />;
    const names = [...new Set(all.flatMap((s) => s.fields.map((f) => f.name)))];
    const common = textOfPoint(commonOf(points));
    return (
        <>
            <div class="split">{lines.map((line) => <Predicted line={line} all={all} at={at} axis={axis} map={map} />)}</div>
            <label class="row">{axis} {figure(at)} <input type="range" min={Math.min(...places)} max={Math.max(...places)} step={(Math.max(...places) - Math.min(...places)) / 200} value={at} aria-label={`${axis} of the predicted shapes`} onInput={(e) => setAt(+e.currentTarget.value)} /></label>
            {names.length > 0 && <div class="row"><label>Map <select value={map} onChange={(e) => setMap(e.currentTarget.value)}><option value="">none</option>{names.map((n) => <option value={n}>{nameOfMap(n)}</option>)}</select></label></div>}
            <p class="quiet">{common ? `All at ${common}. ` : ''}Predicted at {[...new Set(places)].sort((a, b) => a - b).map((v) => figure(v)).join(', ')}; between them interpolated.</p>
        </>
    );
}

/** Structures of a subject in one shape, each in its colour. */
function Structures({ modes, parts, result }: { modes?: ViewOf; parts: ViewOf; result: any }) {
    const rows: any[] = modes ? result.modes : [];
    const whole = parts.shapes.every((i) => i >= 0) && (modes?.shapes ?? []).every((i) => i >= 0);
    const places = useMemo(() => (whole ? placesOf(rows) : new Map<number, number[]>()), []);
    const frames = useMemo(() => result.parts.map((part: any, p: number): Frames => {
        const mean = shapeAt(parts.shapes[p]);
        const shape = (component: number, sd: number) => rows.findIndex((m) => m.component === component && m.part === part.name && m.deviations === sd);
        return { mean, along: new Map([...places].map(([k, list]) => [k, list.map((sd) => (sd === 0 ? mean : shapeAt(modes!.shapes[shape(k, sd)])))])) };
    }), []) as Frames[];
    const [at, setAt] = useState<Record<number, number>>({});
    const [version, setVersion] = useState(0);
    const own = useMemo(() => frames.map((f) => ({ ...copyOf(f.mean), fields: [] })), []);
    const sizes = useMemo(() => sizesOf(result), []);
    const radii = useMemo(() => frames.map((f) => Math.max(...[f.mean, ...[...f.along.values()].flat()].map((s) => boundsOf([s]).radius))), []);
    const joined = useMemo(() => {
        let start = 0;
        const indices = own.flatMap((s) => {
            const list = [...s.indices].map((i) => i + start);
            start += s.positions.length / 3;
            return list;
        });
        return { positions: new Float32Array(3 * start), normals: new Float32Array(3 * start), indices: Uint32Array.from(indices), fields: [] } as Surface3;
    }, []);
    const colours = useMemo(() => Float32Array.from(own.flatMap((s, p) => {
        const rgb = [1, 3, 5].map((i) => linear(parseInt(GROUPS[p % GROUPS.length].slice(i, i + 2), 16) / 255));
        return [...s.positions].map((_, i) => rgb[i % 3]);
    })), []);
    const place = (where: Record<number, number>) => {
        const middles = middlesOf(result, radii, where);
        let start = 0;
        own.forEach((shape, p) => {
            movePart(shape, frames[p], places, where, sizes[p], middles[p]);
            joined.positions.set(shape.positions, start);
            start += shape.positions.length;
        });
        normalsOf(joined);
    };
    const bounds = useMemo(() => {
        place({});
        const { centre, radius } = boundsOf([joined]);
        return { centre, radius: 1.1 * radius };
    }, []);
    useEffect(() => {
        place(at);
        setVersion((v) => v + 1);
    }, [at]);
    const text = Object.entries(at).filter(([, v]) => v).map(([k, v]) => `component ${k}: ${figure(v)} sd`).join(', ') || 'means';
    return (
        <>
            <Turning solid={joined} colours={colours} mapped={false} bounds={bounds} version={version} label={`${result.parts.map((p: any) => p.name).join(', ')}: ${text}`} />
            <p class="row">{result.parts.map((part: any, p: number) => <span><svg class="mark" viewBox="0 0 10 10" aria-hidden="true"><rect width="10" height="10" fill={GROUPS[p % GROUPS.length]} /></svg> {part.name}</span>)}</p>
            {[...places].map(([k, list]) => (
                <label class="row">component {k}: {figure(at[k] ?? 0)} sd <input type="range" min={list[0]} max={list.at(-1)} step={0.05} value={at[k] ?? 0} aria-label={`Component ${k} of the structures`} onInput={(e) => setAt({ ...at, [k]: +e.currentTarget.value })} /></label>
            ))}
            <p class="quiet">{result.positions ? 'Structures are where the model has them.' : 'Where structures are to each other is not in the model: they stand side by side.'}</p>
        </>
    );
}

function Rows({ view }: { view: ViewOf }) {
    const { results } = data.sections[view.section!];
    const rows: any[] = results[view.list!];
    if (rows[0]?.at) return <Predictions view={view} rows={rows} />;
    const other = (list: string) => data.views.find((v) => v.section === view.section && v.list === list);
    const parts = other('parts');
    if (!parts || (view.list === 'parts' && other('modes'))) return null; // they are seen with their modes
    return <Structures parts={parts} modes={view.list === 'modes' ? view : undefined} result={results} />;
}

function start(): void {
    try {
        data = JSON.parse(document.getElementById('data')!.textContent!);
    } catch {
        return; // the frame alone, not filled
    }
    if (data.turn) turnTo(data.turn);
    else rotate(-1.2, 0.5);
    for (const node of document.querySelectorAll<HTMLElement>('[data-section]')) {
        const { results } = data.sections[Number(node.dataset.section)];
        try {
            render(<Findings result={results} />, node);
        } catch (error) {
            console.error(error); // the tables still say it
        }
    }
    // What is wider or longer than its place is scrolled, by keys too.
    for (const table of document.querySelectorAll('table')) if (table.scrollWidth > table.clientWidth || table.scrollHeight > table.clientHeight) table.tabIndex = 0;
    if (!able) return;
    for (const node of document.querySelectorAll<HTMLElement>('[data-view]')) {
        const label = node.querySelector('figcaption')?.textContent ?? node.querySelector('img')?.alt ?? '';
        const place = document.createElement('div');
        const picture = node.querySelector('img');
        if (picture) picture.replaceWith(place);
        else node.prepend(place);
        const view = data.views[Number(node.dataset.view)];
        render(view.kind === 'rows' ? <Rows view={view} /> : <View view={view} label={label} />, place);
    }
}

start();
