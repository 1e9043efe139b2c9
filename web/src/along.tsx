// Predicted shapes along a covariate, as time or age: a slider moves them, those of several groups beside each other.
import { useEffect, useMemo, useState } from 'preact/hooks';
import { between, blend, boundsOf, copyOf } from './geometry';
import type { Surface3 } from './glb';
import { t } from './i18n';
import { aNumber, aText, maybe, oneOf, useKept } from './kept';
import { ColourBar, mapOf, nameOfMap, paintedBy } from './maps';
import { axesOf, commonOf, linesOf, textOfPoint } from './series';
import type { Line, Point } from './series';
import { PictureButtons, View, linked, shapeAt, surfacePath } from './shape';
import { moved } from './stage';
import { Shown, figure, useLoad } from './ui';
import { Path } from './paths';

export interface Prediction { at: Point; surface: { id: string; [name: string]: unknown }; relativeEnergy: number | null }

const LINES_MAX = 6;

/** Over all shapes, so that colours keep their meaning while one becomes another. */
export function wholeRange(shapes: Surface3[], name: string): { low: number; high: number } {
    const fields = shapes.flatMap((s) => s.fields.filter((f) => f.name === name));
    return { low: Math.min(...fields.map((f) => f.low)), high: Math.max(...fields.map((f) => f.high)) };
}

/** One line of predictions at a place along it. */
function Moving({ line, shapes, at, axis, map, all, energies }: {
    line: Line; shapes: Surface3[]; at: number; axis: string; map: string; all: Surface3[]; energies: (number | null)[];
}) {
    const own = useMemo(() => line.members.map((i) => shapes[i]), [line, shapes]);
    const moving = useMemo(() => copyOf(own[0]), [own]);
    const [version, setVersion] = useState(0);
    const look = useMemo(() => boundsOf(all), [all]);
    useEffect(() => {
        blend(moving, own, between(line.places, at));
        moved(moving);
        setVersion((v) => v + 1);
    }, [moving, at]);
    const field = moving.fields.find((f) => f.name === map);
    const shown = field && mapOf({ ...field, ...wholeRange(all, map) });
    const parts = [{ shape: moving, colours: shown && paintedBy(shown) }];
    const exact = line.places.findIndex((p) => Math.abs(p - at) < 1e-9 * Math.max(1, Math.abs(p)));
    const energy = exact < 0 ? null : energies[line.members[exact]];
    const said = `${line.text ? `${line.text}, ` : ''}${axis} ${figure(at)}`;
    return (
        <figure class="shape">
            <View parts={parts} camera={linked} version={version} look={look} label={t`Predicted shape, ${said}`} />
            {shown && <ColourBar map={shown} />}
            <figcaption class="row">
                <span>{said} <span class="quiet">{at < line.places[0] || at > line.places.at(-1)! ? t`beyond what was predicted` : exact < 0 ? t`between predicted shapes` : t`predicted${typeof energy === 'number' ? t`, relative energy ${figure(energy, 2)}` : ''}`}</span></span>
                <span class="no-report"><PictureButtons parts={parts} camera={linked} look={look} name="predicted" map={shown} /></span>
            </figcaption>
        </figure>
    );
}

export function Along({ predictions }: { predictions: Prediction[] }) {
    const points = useMemo(() => predictions.map((p) => p.at), [predictions]);
    const axes = useMemo(() => axesOf(points), [points]);
    const [axis, setAxis] = useKept('along', axes[0], oneOf(axes));
    const loaded = useLoad(() => Promise.all(predictions.map((p) => shapeAt(surfacePath(p.surface.id)))), [predictions]);
    const lines = useMemo(() => (axis ? linesOf(points, axis).filter((l) => l.members.length > 1) : []), [points, axis]);
    const places = [...new Set(lines.flatMap((l) => l.places))].sort((a, b) => a - b);
    const [low, high] = [places[0], places.at(-1)!];
    const [at, setAt] = useKept('at', undefined, maybe(aNumber(low, high)));
    const [playing, setPlaying] = useState(false);
    const [map, setMap] = useKept('colours', '', aText);
    useEffect(() => {
        if (!playing) return;
        let frame = 0;
        const start = performance.now();
        const step = (now: number) => {
            const phase = ((now - start) / 2500) % 2;
            setAt(low + (high - low) * (phase < 1 ? phase : 2 - phase));
            frame = requestAnimationFrame(step);
        };
        frame = requestAnimationFrame(step);
        return () => cancelAnimationFrame(frame);
    }, [playing, low, high]);
    const energies = predictions.map((p) => p.relativeEnergy);
    if (!lines.length) return <Path surfaces={predictions.map((p) => p.surface) as any} texts={points.map(textOfPoint)} energies={energies} />;
    const here = at ?? low;
    const common = textOfPoint(commonOf(points));
    return (
        <Shown of={loaded} label={t`predicted shapes`}>{(shapes) => {
            const names = [...new Set(shapes.flatMap((s) => s.fields.map((f) => f.name)))];
            return (
                <>
                    <div class="row tools no-report">
                        {axes.length > 1 && <label>{t`Along`} <select value={axis} onChange={(e) => { setAt(undefined); setAxis(e.currentTarget.value); }}>
                            {axes.map((name) => <option>{name}</option>)}
                        </select></label>}
                        {names.length > 0 && <label>{t`Map`} <select value={map} onChange={(e) => setMap(e.currentTarget.value)}>
                            <option value="">{t`none`}</option>{names.map((name) => <option value={name}>{nameOfMap(name)}</option>)}
                        </select></label>}
                        <button onClick={() => setPlaying(!playing)} aria-pressed={playing}>{playing ? t`Stop` : t`Play`}</button>
                        <label class="row grow"><span>{axis} <output>{figure(here)}</output></span>
                            <input class="grow" type="range" list="predicted-places" min={low} max={high} step={(high - low) / 200} value={here} aria-label={t`${axis} of the predicted shapes`}
                                onInput={(e) => { setPlaying(false); setAt(+e.currentTarget.value); }} /></label>
                        <datalist id="predicted-places">{places.map((p) => <option value={p} />)}</datalist>
                    </div>
                    <div class="split">{lines.slice(0, LINES_MAX).map((line) => <Moving key={`${axis} ${line.text}`} line={line} shapes={shapes} at={here} axis={axis} map={map} all={shapes} energies={energies} />)}</div>
                    <p class="quiet">{t`${common ? t`All at ${common}. ` : ''}Shapes were predicted at ${axis} ${places.map((p) => figure(p)).join(', ')}; between them they are interpolated.${lines.length > LINES_MAX ? t` ${lines.length - LINES_MAX} more lines are not shown.` : ''}`}</p>
                    {map && shapes[0].fields.find((f) => f.name === map)?.meaning && <p class="quiet">{shapes[0].fields.find((f) => f.name === map)!.meaning}</p>}
                </>
            );
        }}</Shown>
    );
}
