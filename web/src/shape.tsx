// Shapes on the page: a view that turns by pointer and keys, with maps, a colour bar and pictures to take away; and a
// gallery of many.
import { useEffect, useMemo, useRef, useState } from 'preact/hooks';
import * as api from './api';
import { groupLook } from './colours';
import { boundsOf } from './geometry';
import { readGlb } from './glb';
import type { Surface3 } from './glb';
import { bothApart } from './apart';
import type { Apart } from './apart';
import { t } from './i18n';
import { ColourBar, colourOf, isFlipped, mapOf, nameOfMap, paintedBy, titleOf, unitOf } from './maps';
import type { Map3 } from './maps';
import { aNumber, keep, keptText, maybe, useKept } from './kept';
import type { Written } from './kept';
import { came, link } from './router';
import { mayChange } from './state';
import { Camera, draw, forget, pick, shrink } from './stage';
import type { Look, Part } from './stage';
import { ProblemBox, csv, figure, save } from './ui';

/** The camera of all views that are linked. */
export const linked = new Camera();
const FIRST = linked.text;

const cache = new Map<string, Promise<Surface3>>();
const CACHE_MAX = 60;

/** A shape by its address; those seen last stay. */
export function shapeAt(path: string): Promise<Surface3> {
    let shape = cache.get(path);
    if (shape) cache.delete(path);
    else {
        shape = api.bytes(path).then(readGlb);
        shape.catch(() => cache.delete(path));
    }
    cache.set(path, shape);
    if (cache.size > CACHE_MAX) {
        const [oldest, gone] = cache.entries().next().value!;
        cache.delete(oldest);
        gone.then(forget, () => {});
    }
    return shape;
}

export const surfacePath = (id: string, resolution = 24): string => `/v1/surfaces/${id}/mesh?format=glb&resolution=${resolution}`;
export const originalPath = (id: string): string => `${surfacePath(id, 32)}&space=original`;
export const shapePath = (id: string, resolution = 24): string =>
    id.startsWith('mesh-') ? `/v1/meshes/${id}/content?format=glb` : surfacePath(id, resolution);

export function useShape(path: string | null): { path?: string; shape?: Surface3; error?: unknown } {
    const [state, setState] = useState<{ path?: string; shape?: Surface3; error?: unknown }>({});
    useEffect(() => {
        let gone = false;
        if (path) shapeAt(path).then((shape) => !gone && setState({ path, shape }), (error) => !gone && setState({ error }));
        return () => { gone = true; };
    }, [path]);
    return state;
}

const KEYS: Record<string, (c: Camera) => void> = {
    ArrowLeft: (c) => c.rotate(0, -0.15), ArrowRight: (c) => c.rotate(0, 0.15), ArrowUp: (c) => c.rotate(-0.15, 0), ArrowDown: (c) => c.rotate(0.15, 0),
    '+': (c) => c.scale(1.15), '=': (c) => c.scale(1.15), '-': (c) => c.scale(1 / 1.15),
};
for (let n = 0; n <= 6; n++) KEYS[`${n}`] = (c) => c.side(n);

/** What each canvas shows, for reports. */
export const shown = new WeakMap<HTMLCanvasElement, { parts: Part[]; camera: Camera; look: Look }>();

/** The address has the turn of a camera, under a name; and where it has one as the view comes, the camera is that. */
function useCamera(camera: Camera, name: string | undefined): void {
    useEffect(() => {
        if (!name) return;
        const take = () => { camera.text = keptText(name) ?? camera.text; };
        const put = () => keep(name, camera.text === FIRST ? null : camera.text);
        take();
        if (camera.text !== FIRST) put(); // it was turned on another page
        const stops = [came.listen(take), camera.listen(put)];
        return () => stops.forEach((stop) => stop());
    }, [camera, name]);
}

/** A canvas in which parts are seen from a camera; drawn when either changes. */
export function View({ parts, camera, label, look, version = 0, onLink, onHover, onPick, className = 'view', kept }: {
    parts: Part[]; camera: Camera; label: string; look?: Partial<Look>; version?: number; onLink?: () => void; className?: string;
    /** Told of the vertex of the first part under the pointer, and of one that was clicked. */
    onHover?: (vertex: number | undefined) => void; onPick?: (vertex: number) => void;
    /** What the address calls a camera that is not the one of all linked views. */
    kept?: string;
}) {
    useCamera(camera, camera === linked ? 'view' : kept);
    const canvas = useRef<HTMLCanvasElement>(null);
    const bounds = useMemo(() => boundsOf(parts.map((p) => p.shape)), [parts[0]?.shape, parts.length]);
    const all: Look = { ...bounds, ...look };
    const paint = useRef(() => {});
    paint.current = () => {
        if (!canvas.current) return;
        shown.set(canvas.current, { parts, camera, look: all });
        draw(canvas.current, parts, camera, all);
    };
    useEffect(() => {
        let asked = 0;
        const soon = () => {
            if (!asked) asked = requestAnimationFrame(() => { asked = 0; paint.current(); });
        };
        const unlisten = camera.listen(soon);
        const watch = new ResizeObserver(() => {
            const c = canvas.current;
            if (!c) return;
            const ratio = Math.min(2, devicePixelRatio || 1);
            c.width = Math.round(c.clientWidth * ratio);
            c.height = Math.round(c.clientHeight * ratio);
            soon();
        });
        watch.observe(canvas.current!);
        return () => {
            unlisten();
            watch.disconnect();
            cancelAnimationFrame(asked);
        };
    }, [camera]);
    useEffect(() => paint.current());
    useEffect(() => paint.current(), [version]);
    const hold = useRef<[number, number] | null>(null);
    const pressed = useRef<[number, number]>([0, 0]);
    const under = (e: { clientX: number; clientY: number }) => {
        const box = canvas.current!.getBoundingClientRect();
        return pick(parts[0].shape, camera, all, box.width / box.height, (e.clientX - box.left) / box.width, (e.clientY - box.top) / box.height);
    };
    const hovered = useRef(0);
    const hover = (e: PointerEvent) => {
        if (!onHover || hovered.current) return;
        hovered.current = requestAnimationFrame(() => {
            hovered.current = 0;
            if (canvas.current) onHover(under(e));
        });
    };
    return (
        <canvas ref={canvas} class={className} tabIndex={0} role="img" aria-label={t`${label}. Arrows turn it, + and - change its size, 0 to 6 are views.`}
            onPointerDown={(e) => { hold.current = pressed.current = [e.clientX, e.clientY]; e.currentTarget.setPointerCapture(e.pointerId); }}
            onPointerMove={(e) => {
                if (!hold.current) return hover(e);
                camera.rotate((e.clientY - hold.current[1]) / 120, (e.clientX - hold.current[0]) / 120);
                hold.current = [e.clientX, e.clientY];
            }}
            onPointerUp={(e) => {
                hold.current = null;
                if (!onPick || Math.hypot(e.clientX - pressed.current[0], e.clientY - pressed.current[1]) > 4) return;
                const vertex = under(e);
                if (vertex !== undefined) onPick(vertex);
            }}
            onPointerLeave={() => onHover?.(undefined)}
            onPointerCancel={() => { hold.current = null; }}
            onWheel={(e) => { if (document.activeElement === e.currentTarget) { e.preventDefault(); camera.scale(Math.exp(-e.deltaY / 500)); } }}
            onKeyDown={(e) => {
                const act = KEYS[e.key];
                if (act) {
                    act(camera);
                    e.preventDefault();
                } else if (e.key.toLowerCase() === 'l' && onLink) onLink();
            }} />
    );
}

// ---- Pictures --------------------------------------------------------------------------------------------------------

/** The colour bar of a map at the foot of a picture, with dark letters. */
function putBar(canvas: HTMLCanvasElement, map: Map3): void {
    const pen = canvas.getContext('2d')!;
    const unit = canvas.width / 100;
    const [left, top, width] = [30 * unit, 94 * unit, 40 * unit];
    pen.fillStyle = '#222222';
    pen.font = `${2.2 * unit}px Helvetica, Arial, sans-serif`;
    pen.fillText(titleOf(map), left, top - 0.8 * unit);
    pen.textBaseline = 'top';
    pen.fillText(figure(map.low), left, top + 3 * unit);
    pen.textAlign = 'right';
    pen.fillText(figure(map.high), left + width, top + 3 * unit);
    const bar = pen.createLinearGradient(left, 0, left + width, 0);
    for (let i = 0; i <= 10; i++) bar.addColorStop(i / 10, colourOf(map, i / 10));
    pen.fillStyle = bar;
    pen.fillRect(left, top, width, 2.4 * unit);
}

export async function picture(parts: Part[], camera: Camera, look: Partial<Look>, side = 2000, background: string | null = '#ffffff', map?: Map3): Promise<Blob> {
    const canvas = document.createElement('canvas');
    canvas.width = canvas.height = side;
    draw(canvas, parts, camera, { ...boundsOf(parts.map((p) => p.shape)), ...look, background });
    shrink();
    if (map) putBar(canvas, map);
    return new Promise((yes) => canvas.toBlob((blob) => yes(blob!), 'image/png'));
}

export function PictureButtons({ parts, camera, look = {}, name, map }: { parts: Part[]; camera: Camera; look?: Partial<Look>; name: string; map?: Map3 }) {
    const [bar, setBar] = useState(true);
    const [side, setSide] = useState(2000);
    const [clear, setClear] = useState(false);
    return (
        <details class="menu"><summary>{t`Picture`}</summary>
            <div class="card">
                <label>{t`Pixels`} <input type="number" min={100} max={8000} step={100} value={side} onChange={(e) => setSide(+e.currentTarget.value || 2000)} /></label>
                <label class="check"><input type="checkbox" checked={clear} onChange={(e) => setClear(e.currentTarget.checked)} /> {t`transparent`}</label>
                {map && <label class="check"><input type="checkbox" checked={bar} onChange={(e) => setBar(e.currentTarget.checked)} /> {t`with its colours`}</label>}
                <button onClick={async () => save(`${name}.png`, await picture(parts, camera, look, Math.min(8000, side), clear ? null : '#ffffff', bar ? map : undefined))}>{t`PNG`}</button>
            </div>
        </details>
    );
}

/** A menu of files that are fetched when they are asked for. */
export function Downloads({ files, name }: { files: [format: string, path: string][]; name: string }) {
    const [failed, setFailed] = useState<unknown>();
    const take = async (format: string, path: string) => {
        setFailed(undefined);
        try {
            save(`${name}.${format}`, await (await api.request(path)).blob());
        } catch (error) {
            setFailed(error);
        }
    };
    return (
        <>
            <details class="menu"><summary>{t`Download`}</summary><div class="card">
                {files.map(([format, path]) => <button onClick={() => void take(format, path)}>{format.toUpperCase()}</button>)}
            </div></details>
            {failed ? <ProblemBox error={failed} /> : null}
        </>
    );
}

// ---- One shape with all there is to set ------------------------------------------------------------------------------

interface Landmark { name: string; vertex: number }

/** A range of colours, and from where on they are shown, as typed; empty: as usual. */
interface Range { low: string; high: string; least: string }
const USUAL: Range = { low: '', high: '', least: '' };
const aRange: Written<Range> = {
    write: (r) => [r.low, r.high, r.least].join(','),
    read: (text) => {
        const [low, high, least] = text.split(',').map((part) => (numberOf(part) === undefined ? '' : part.trim()));
        return least === undefined ? undefined : { low, high, least };
    },
};
const LANDMARKS_MAX = 500;
const someLandmarks: Written<Landmark[]> = {
    write: (list) => list.map((l) => `${l.vertex}:${encodeURIComponent(l.name)}`).join(','),
    read: (text) => text.split(',', LANDMARKS_MAX).flatMap((part, i) => {
        const [vertex, name] = part.split(':');
        if (!/^\d{1,9}$/.test(vertex)) return [];
        try {
            return [{ vertex: +vertex, name: decodeURIComponent(name ?? `${i + 1}`) }];
        } catch {
            return [{ vertex: +vertex, name: `${i + 1}` }];
        }
    }),
};
const aMap: Written<string> = { write: (v) => v || 'none', read: (text) => (text === 'none' ? '' : text) };
const numberOf = (text: string): number | undefined => (text.trim() !== '' && Number.isFinite(Number(text)) ? Number(text) : undefined);

/** A map in that range. What is to be seen is what is large, of either sign; of p what is small. */
function inRange(map: Map3, range: Range): Map3 {
    const [low, high, least] = [numberOf(range.low) ?? map.low, numberOf(range.high) ?? map.high, numberOf(range.least)];
    const keep = least === undefined ? undefined : isFlipped(map) ? (v: number) => v <= least : (v: number) => Math.abs(v) >= least;
    return { ...map, low, high: high > low ? high : low + 1e-12, keep };
}

const VIEWS: [number, string][] = [[0, t`first view`], [1, 'front'], [2, 'back'], [3, 'left'], [4, 'right'], [5, 'above'], [6, 'below']];

/** How far the other of two surfaces is, at each vertex; computed here. */
function useApart(shape: Surface3 | undefined, other: Surface3 | undefined, unit: string): Apart | undefined {
    const [state, setState] = useState<{ shape?: Surface3; other?: Surface3; found?: Apart }>({});
    useEffect(() => {
        let gone = false;
        if (shape && other) void bothApart(shape, other, unit, () => gone).then((found) => gone || setState({ shape, other, found }));
        return () => { gone = true; };
    }, [shape, other, unit]);
    return shape && state.shape === shape && state.other === other ? state.found : undefined;
}

export function Shape({ src, label, name, marks, downloads, over, first: shownFirst = '', mesh, unit }: {
    /** Of coordinates, where it is known. */
    unit?: 'mm';
    src: string; label: string; name: string; marks?: api.MeshProblem[]; downloads?: [string, string][]; over?: string;
    /** The map that is shown first. */
    first?: string;
    /** The mesh whose vertices these are, of which landmarks can guide a registration. */
    mesh?: string;
}) {
    const { shape, error } = useShape(src);
    const other = useShape(over ?? null);
    const camera = useMemo(() => new Camera(), []);
    const [field, setField] = useKept('map', shownFirst, aMap);
    const [cutAt, setCut] = useKept<number | undefined>('cut', undefined, maybe(aNumber(-1, 1)));
    const cut = cutAt ?? null;
    const [here, setHere] = useState<number | undefined>();
    const [given, setLandmarks] = useKept<Landmark[]>('points', [], someLandmarks);
    const [placing, setPlacing] = useState(given.length > 0);
    const [range, setRange] = useKept<Range>('range', USUAL, aRange);
    const distance = useApart(shape, over && other.path === over ? other.shape : undefined, unit ?? 'length');
    const own = useRef<HTMLElement>(null);
    const first = useRef(src);
    useEffect(() => {
        if (first.current !== src) setLandmarks([]);
        first.current = src;
    }, [src]);
    if (error) return <ProblemBox error={error} />;
    if (!shape) return <p class="quiet" aria-busy="true">{t`Loading the shape…`}</p>;
    const landmarks = given.filter((l) => 3 * l.vertex + 2 < shape.positions.length);
    const fields = distance ? [...shape.fields, distance.field] : shape.fields;
    const chosen = fields.find((f) => f.name === field);
    const map = chosen && inRange(mapOf(chosen), range);
    const parts: Part[] = [{ shape, colours: map && paintedBy(map) }];
    const among = !!distance && chosen === distance.field;
    if (over && other.shape && other.path === over && !among) parts.push({ shape: other.shape, colour: '#0072b2', opacity: 0.45 });
    const problem = marks?.find((m) => typeof m.first === 'number')?.first;
    const face = typeof problem === 'number' && 3 * problem + 2 < shape.indices.length ? shape.indices[3 * problem] : undefined;
    const at = (vertex: number) => [...shape.positions.slice(3 * vertex, 3 * vertex + 3)];
    const mark = face !== undefined ? at(face) : undefined;
    const look = { cut, mark: landmarks.length ? landmarks.flatMap((l) => at(l.vertex)).concat(mark ?? []) : mark };
    const lengthTo = (i: number): number => Math.hypot(...at(landmarks[i].vertex).map((v, k) => v - at(landmarks[i - 1].vertex)[k]));
    const add = (vertex: number) => setLandmarks((list) => [...list, { name: `${list.length + 1}`, vertex }]);
    const centre = () => {
        const canvas = own.current!.querySelector('canvas')!;
        const held = shown.get(canvas)!;
        const vertex = pick(shape, camera, held.look, canvas.clientWidth / canvas.clientHeight, 0.5, 0.5);
        if (vertex !== undefined) add(vertex);
    };
    return (
        <figure class="shape" ref={own}>
            <View parts={parts} camera={camera} label={map ? t`${label}, coloured by ${nameOfMap(map.field.name)}` : label} look={look}
                onHover={map ? setHere : undefined} onPick={placing ? add : undefined} kept="turn" />
            <figcaption class="row">
                {fields.length > 0 && (
                    <label>{t`Map`} <select value={field} onChange={(e) => { setField(e.currentTarget.value); setRange(USUAL); }}>
                        <option value="">{t`none`}</option>{fields.map((f) => <option value={f.name}>{nameOfMap(f.name)}</option>)}
                    </select></label>
                )}
                <label class="check"><input type="checkbox" checked={cut !== null} onChange={(e) => setCut(e.currentTarget.checked ? 0 : undefined)} /> {t`Cut`}</label>
                {cut !== null && <input type="range" min={-1} max={1} step={0.01} value={cut} aria-label={t`Where it is cut`} onInput={(e) => setCut(+e.currentTarget.value)} />}
                <label class="check"><input type="checkbox" checked={placing} onChange={(e) => setPlacing(e.currentTarget.checked)} /> {t`Landmarks`}</label>
                <label class="no-report"><span class="sr">{t`View`}</span> <select value="" onChange={(e) => { camera.side(+e.currentTarget.value); e.currentTarget.value = ''; }}>
                    <option value="">{t`View…`}</option>{VIEWS.map(([n, text]) => <option value={n}>{t`${text} (key ${n})`}</option>)}
                </select></label>
                <PictureButtons parts={parts} camera={camera} look={look} name={name} map={map} />
                {downloads && <Downloads files={downloads} name={name} />}
            </figcaption>
            {map && <ColourBar map={map} threshold={numberOf(range.least)} />}
            {map && (
                <details class="no-report"><summary>{t`Range and threshold`}</summary>
                    <div class="row">
                        {([['low', t`From`, mapOf(map.field).low], ['high', t`to`, mapOf(map.field).high], ['least', isFlipped(map) ? t`grey above` : t`grey below`, undefined]] as [keyof Range, string, number?][]).map(([key, text, usual]) => (
                            <label>{text} <input type="number" step="any" value={range[key]} placeholder={usual === undefined ? t`none` : figure(usual)} onInput={(e) => setRange({ ...range, [key]: e.currentTarget.value })} /></label>
                        ))}
                        {range !== USUAL && <button onClick={() => setRange(USUAL)}>{t`As usual`}</button>}
                    </div>
                    {!isFlipped(map) && map.scale === 'signed' && <p class="quiet">{t`Grey: what is nearer to 0, of either sign.`}</p>}
                </details>
            )}
            {map && <p class="quiet">{here === undefined ? t`Point at the shape to read the map.` : t`Here ${figure(map.field.values[here])}${unitOf(map.field) ? ` (${unitOf(map.field)})` : ''}, vertex ${here}.`}</p>}
            {placing && (
                <div>
                    <div class="actions">
                        <button onClick={centre}>{t`Landmark at the middle of the view`}</button>
                        {landmarks.length > 0 && <button onClick={() => save(`${name}-landmarks.csv`, csv([['name', 'vertex', 'x', 'y', 'z'], ...landmarks.map((l) => [l.name, l.vertex, ...at(l.vertex)])]), 'text/csv;charset=utf-8')}>{t`Landmarks as CSV`}</button>}
                        {mesh && mayChange() && landmarks.length > 0 && <a class="button" href={`${link('analyses', 'register')}?template=${mesh}&landmarks=${encodeURIComponent(JSON.stringify({ template: landmarks.map((l) => l.vertex), moving: [] }))}`}>{t`Register a shape by these`}</a>}
                    </div>
                    <p class="quiet">{t`Click the shape to place one. Coordinates are ${unit ? t`those of the file, whose unit is taken to be the millimetre` : t`those of the shape as it is shown, which is brought to a common size`}. Two measure the straight line between them.`}</p>
                    <ol aria-label={t`Landmarks`}>{landmarks.map((l, i) => (
                        <li class="row">
                            <input aria-label={t`Name of landmark ${i + 1}`} value={l.name} onInput={(e) => { const text = e.currentTarget.value; setLandmarks((list) => list.map((m, k) => (k === i ? { ...m, name: text } : m))); }} />
                            <span class="quiet grow">{at(l.vertex).map((v) => figure(v)).join(', ')}{i > 0 ? <strong class="length"> {t`${figure(lengthTo(i))}${unit ? ` ${unit}` : ''} from ${landmarks[i - 1].name}`}</strong> : null}</span>
                            <button aria-label={t`Remove landmark ${i + 1}`} onClick={() => setLandmarks((list) => list.filter((_, k) => k !== i))}>{t`Remove`}</button>
                        </li>
                    ))}</ol>
                </div>
            )}
            {distance && <p role="status">{t`The two surfaces are ${figure(distance.rms)} apart (root mean square, from both sides); 95 % within ${figure(distance.p95)}, all within ${figure(distance.max)}${unitOf(distance.field) ? ` (${unitOf(distance.field)})` : ''}.`}</p>}
            {map?.field.meaning && <p class="quiet">{map.field.meaning}</p>}
            {mark && <p class="quiet">{t`The dot marks the first place of the problem.`}</p>}
        </figure>
    );
}

// ---- Many shapes -----------------------------------------------------------------------------------------------------

function Thumbnail({ id, name, colour, mark }: { id: string; name: string; colour?: string; mark?: string }) {
    const canvas = useRef<HTMLCanvasElement>(null);
    const [lost, setLost] = useState(false);
    useEffect(() => {
        let gone = false;
        const watch = new IntersectionObserver((seen) => {
            if (!seen.some((s) => s.isIntersecting)) return;
            watch.disconnect();
            shapeAt(shapePath(id, 12)).then((shape) => {
                if (gone || !canvas.current) return;
                draw(canvas.current, [{ shape, colour: '#c8b090' }], linked, boundsOf([shape]));
            }, () => setLost(true));
        }, { rootMargin: '200px' });
        watch.observe(canvas.current!);
        const unlisten = linked.listen(() => {
            if (cache.has(shapePath(id, 12))) {
                shapeAt(shapePath(id, 12)).then((shape) => canvas.current && draw(canvas.current, [{ shape, colour: '#c8b090' }], linked, boundsOf([shape])), () => {});
            }
        });
        return () => {
            gone = true;
            watch.disconnect();
            unlisten();
        };
    }, [id]);
    return (
        <a class="thumb" href={id.startsWith('mesh-') ? link('meshes', id) : link('shapes', id)}>
            <canvas ref={canvas} width={160} height={160} aria-hidden="true" />
            <span>{mark && <svg viewBox="-7 -7 14 14" width="12" height="12" aria-hidden="true"><path d={mark} fill={colour} /></svg>} {name}{lost ? t` (cannot be shown)` : ''}</span>
        </a>
    );
}

export function Gallery({ members }: { members: { id: string; name: string; group?: string }[] }) {
    const groups = [...new Set(members.map((m) => m.group).filter((g): g is string => !!g))];
    const [all, setAll] = useState(false);
    const shown = all ? members : members.slice(0, 24);
    return (
        <section>
            <h2>{t`Shapes`}</h2>
            {groups.length > 0 && (
                <p class="row legend">{groups.map((g) => {
                    const { colour, path } = groupLook(groups, g);
                    return <span><svg viewBox="-7 -7 14 14" width="12" height="12" aria-hidden="true"><path d={path} fill={colour} /></svg> {g}</span>;
                })}</p>
            )}
            <div class="gallery">{shown.map((m, i) => {
                const { colour, path } = groupLook(groups, m.group);
                return <Thumbnail key={`${m.id}-${i}`} id={m.id} name={m.name} colour={colour} mark={m.group ? path : undefined} />;
            })}</div>
            {members.length > shown.length && <button onClick={() => setAll(true)}>{t`Show all ${members.length}`}</button>}
        </section>
    );
}
