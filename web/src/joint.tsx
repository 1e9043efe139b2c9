// Several structures of each subject together: all in one view, moved along joint components.
import { useEffect, useMemo, useState } from 'preact/hooks';
import type * as api from './api';
import { DataTable } from './charts';
import { JointCharts } from './charts_joint';
import { GROUPS } from './colours';
import { boundsOf, copyOf, normalsOf } from './geometry';
import type { Surface3 } from './glb';
import { Linked } from './paths';
import { link } from './router';
import { middlesOf, movePart, placesOf, sizesOf } from './series';
import type { Frames } from './series';
import { PictureButtons, View, linked, shapeAt, surfacePath } from './shape';
import { mayChange } from './state';
import { moved } from './stage';
import { Shown, figure, plural, useLoad } from './ui';

const radiusOf = (shape: Surface3): number => boundsOf([shape]).radius;

async function load(result: any, places: Map<number, number[]>): Promise<Frames[]> {
    return Promise.all(result.parts.map(async (part: any): Promise<Frames> => {
        const mean = await shapeAt(surfacePath(part.mean.id));
        const along = new Map<number, Surface3[]>();
        for (const [component, list] of places) {
            along.set(component, await Promise.all(list.map((sd) => {
                const mode = result.modes.find((m: any) => m.component === component && m.part === part.name && m.deviations === sd);
                return mode ? shapeAt(surfacePath(mode.surface.id)) : mean;
            })));
        }
        return { mean, along };
    }));
}

function Together({ result, frames, places }: { result: any; frames: Frames[]; places: Map<number, number[]> }) {
    const [at, setAt] = useState<Record<number, number>>({});
    const [playing, setPlaying] = useState(0);
    const [version, setVersion] = useState(0);
    const moving = useMemo(() => frames.map((f) => ({ ...copyOf(f.mean), fields: [] })), [frames]);
    const radii = useMemo(() => frames.map((f) => Math.max(radiusOf(f.mean), ...[...f.along.values()].flat().map(radiusOf))), [frames]);
    const sizes = useMemo(() => sizesOf(result), [result]);
    const place = (where: Record<number, number>) => {
        const middles = middlesOf(result, radii, where);
        moving.forEach((shape, p) => {
            movePart(shape, frames[p], places, where, sizes[p], middles[p]);
            normalsOf(shape);
            moved(shape);
        });
        setVersion((v) => v + 1);
    };
    const look = useMemo(() => {
        place({});
        return boundsOf(moving);
    }, [moving]);
    useEffect(() => place(at), [at, moving]);
    useEffect(() => {
        if (!playing) return;
        let frame = 0;
        const start = performance.now();
        const step = (now: number) => {
            setAt((a) => ({ ...a, [playing]: 2 * Math.sin((now - start) / 900) }));
            frame = requestAnimationFrame(step);
        };
        frame = requestAnimationFrame(step);
        return () => cancelAnimationFrame(frame);
    }, [playing]);
    const parts = moving.map((shape, p) => ({ shape, colour: GROUPS[p % GROUPS.length] }));
    const active = Object.entries(at).filter(([, v]) => v !== 0);
    const text = active.map(([k, v]) => `component ${k}: ${v > 0 ? '+' : ''}${figure(v)} sd`).join(', ') || 'means';
    return (
        <div class="split">
            <figure class="shape tall">
                <View parts={parts} camera={linked} version={version} look={{ ...look, radius: 1.1 * look.radius }} label={`${result.parts.map((p: any) => p.name).join(', ')}: ${text}`} />
                <figcaption class="row">{text}<span class="no-report"><PictureButtons parts={parts} camera={linked} look={look} name="structures" /></span></figcaption>
                <p class="row legend">{result.parts.map((part: any, p: number) => <span><svg viewBox="0 0 10 10" width="12" height="12" aria-hidden="true"><rect width="10" height="10" fill={GROUPS[p % GROUPS.length]} /></svg> {part.name}</span>)}</p>
            </figure>
            <div class="no-report">
                {[...places].map(([component, list]) => {
                    const energies = result.modes.filter((m: any) => m.component === component && typeof m.relativeEnergy === 'number').map((m: any) => m.relativeEnergy);
                    return (
                        <div class="field" key={component}>
                            <label for={`joint-${component}`}>Component {component} <span class="quiet">{figure(100 * (result.explained[component - 1] ?? 0))} % of the variance, now {figure(at[component] ?? 0)} sd</span></label>
                            <div class="row">
                                <input id={`joint-${component}`} class="grow" type="range" min={list[0]} max={list.at(-1)} step={0.05} value={at[component] ?? 0}
                                    onInput={(e) => { setPlaying(0); setAt({ ...at, [component]: +e.currentTarget.value }); }} />
                                <button aria-pressed={playing === component} onClick={() => setPlaying(playing === component ? 0 : component)}>{playing === component ? 'Stop' : 'Play'}</button>
                            </div>
                            <p class="help">Relative energy at {list.filter((v) => v).map((v) => figure(v)).join(' and ')} sd: at most {figure(Math.max(...energies), 2)} (0: the shapes exist).</p>
                        </div>
                    );
                })}
                <div class="actions">
                    <button onClick={() => { setPlaying(0); setAt({}); }}>Back to the means</button>
                </div>
                <p class="quiet">Shapes between those that were computed are interpolated{places.size > 1 ? ', with the displacements of several components added' : ''}.
                    {result.positions ? ' Structures are where the model has them, in units of the root of their total area.' : ' Where structures are to each other is not in this model: they stand side by side, in their sizes.'}</p>
            </div>
        </div>
    );
}

/** The shapes of a subject, one of each structure. */
function Subject({ result, index }: { result: any; index: number }) {
    const cohort = result.inputs?.cohort ?? {};
    const n = result.subjects?.length ?? 0;
    const ids: string[] = result.parts.map((_: unknown, p: number) => cohort.surfaces?.[p * n + index]).filter(Boolean);
    return (
        <>
            <h3>{result.subjects[index]}</h3>
            <div class="gallery">{ids.map((id, p) => <Linked key={id} id={id} title={result.parts[p].name} colour={GROUPS[p % GROUPS.length]} />)}</div>
        </>
    );
}

export function Joint({ result, job }: { result: api.Outputs<'pca-parts'>; job: api.Job }) {
    const [chosen, setChosen] = useState<number | undefined>();
    const places = useMemo(() => placesOf(result.modes as any), [result]);
    const loaded = useLoad(() => load(result, places), [result]);
    const more = Math.min(result.eigenvalues.length, Math.max(3, places.size + 2));
    return (
        <>
            <p class="quiet">{plural(result.subjects.length, 'subject')}, {plural(result.parts.length, 'structure')} of each, {plural(result.eigenvalues.length, 'component')}.</p>
            <Shown of={loaded} label="the structures">{(frames) => <Together result={result} frames={frames} places={places} />}</Shown>
            {mayChange() && places.size < more && <p class="no-report"><a class="button" href={`${link('analyses', 'pca-parts')}?rerun=${job.id}&modes=${more}`}>{places.size ? 'More components to move' : 'Components to move'}</a></p>}
            <div class="split"><JointCharts result={result} chosen={chosen} onChoose={setChosen} /></div>
            {chosen !== undefined ? <Subject result={result} index={chosen} /> : <p class="quiet no-report">Choose a mark among the scores to see the structures of that subject.</p>}
            <h2>Structures</h2>
            <DataTable rows={[['structure', 'weight', 'share of the variance', 'relative energy of its mean', 'iterations', 'converged'],
                ...result.parts.map((p: any) => [p.name, p.weight, p.share, p.relativeEnergy, p.iterations, p.converged ? 'yes' : 'no'])]} />
            <div class="actions no-report">{result.parts.map((p: any) => <a class="button" href={link('shapes', p.mean.id)}>Mean of {p.name}</a>)}</div>
        </>
    );
}
