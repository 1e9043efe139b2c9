// Landmarks of a pair: where they are on both shapes, and what a registration leaves between them.
import { useEffect, useMemo, useState } from 'preact/hooks';
import * as api from './api';
import { DataTable } from './charts';
import { LandmarkChart } from './charts_joint';
import type { Surface3 } from './glb';
import { t } from './i18n';
import { Linked, Path } from './paths';
import { link } from './router';
import { Shape, View, linked, shapeAt, surfacePath } from './shape';
import type { Camera } from './stage';
import { figure, plural } from './ui';

/** Numbers of vertices, or positions. */
export type Place = number | number[];

/** What landmarks of a shape are placed on: the mesh that it comes from, by vertices; or itself, by positions. */
export interface Ground { shape: Surface3; vertices: boolean }

async function groundOf(id: string): Promise<Ground> {
    const mesh = async (of: string) => ({ shape: await shapeAt(`/v1/meshes/${of}/content?format=glb`), vertices: true });
    if (id.startsWith('mesh-')) return mesh(id);
    const surface = await api.get('/v1/surfaces/{id}', { id });
    if (surface.source?.mesh && !surface.mirrored) {
        try {
            return await mesh(surface.source.mesh);
        } catch {
            /* The mesh was deleted: the surface itself is there. */
        }
    }
    return { shape: await shapeAt(`${surfacePath(id, 32)}&space=original`), vertices: false };
}

export function useGround(id: string | undefined): { ground?: Ground; error?: unknown } {
    const [state, setState] = useState<{ id?: string; ground?: Ground; error?: unknown }>({});
    useEffect(() => {
        let gone = false;
        if (id) groundOf(id).then((ground) => !gone && setState({ id, ground }), (error) => !gone && setState({ id, error }));
        return () => { gone = true; };
    }, [id]);
    return state.id === id ? state : {};
}

/** A landmark as a point of the shape, if it is one. */
export const pointOf = (ground: Ground, place: Place): number[] | undefined =>
    Array.isArray(place) ? place : ground.vertices && 3 * place + 2 < ground.shape.positions.length ? [...ground.shape.positions.slice(3 * place, 3 * place + 3)] : undefined;

/** A shape with its landmarks, numbered. */
export function Marked({ ground, places, label, camera = linked, onPick }: { ground: Ground; places: Place[]; label: string; camera?: Camera; onPick?: (vertex: number) => void }) {
    const known = places.map((p) => pointOf(ground, p));
    const marks = known.flatMap((p) => p ?? []);
    const texts = known.flatMap((p, i) => (p ? [`${i + 1}`] : []));
    return <View parts={[{ shape: ground.shape }]} camera={camera} label={`${label}, ${plural(texts.length, 'landmark')}`} look={marks.length ? { mark: marks, markTexts: texts } : undefined} onPick={onPick} version={marks.length} />;
}

function End({ id, places, title }: { id: string; places: Place[]; title: string }) {
    const { ground } = useGround(id);
    return (
        <figure class="shape">
            {ground ? <Marked ground={ground} places={places} label={title} /> : <div class="view" aria-busy="true" />}
            <figcaption>{title}</figcaption>
        </figure>
    );
}

const summary = (of: any): string => t`${plural(of.count, 'landmark')}, ${figure(of.rmsDistance)} in the mean (root of squares), ${figure(of.maxDistance)} at most`;

/** What is left at each, and at those that were held out. */
export function LandmarkResult({ found, given, ends, ids }: { found: any; given: any; ends: [string, string]; ids: [string, string] }) {
    if (!found) return null;
    return (
        <section aria-label={t`Landmarks`}>
            <h2>{t`Landmarks`}</h2>
            {found.guiding && <p>{t`Guided by ${summary(found.guiding)}${found.weight === 'exact' ? t`: they were to be met exactly` : t`; weight ${figure(found.weight)}`}.`}</p>}
            {found.heldOut && <p><strong>{t`Held out: ${summary(found.heldOut)}.`}</strong> {t`The registration did not see these: they tell how well it corresponds elsewhere.`}</p>}
            <div class="split">
                <LandmarkChart points={found.points} />
                {given && ends.map((end, e) => ids[e] && <End key={ids[e]} id={ids[e]} places={given[end] ?? []} title={end} />)}
            </div>
            <DataTable rows={[[t`landmark`, t`held out`, t`distance that is left`, t`angle that is left (rad)`, t`given point off ${ends[0]}`, t`given point off ${ends[1]}`],
                ...found.points.map((p: any, i: number) => [i + 1, p.heldOut ? t`yes` : '–', p.distance, p.angle, p.offFixed, p.offMoving])]} />
            <p class="quiet">{t`Distances are straight lines on the moving surface, in its units. Points off a surface were given beside it: the nearest point of it stands for each.`}</p>
        </section>
    );
}

const idOf = (value: any): string => (typeof value === 'string' ? value : value?.id ?? value?.surface ?? '');

/** A pair that was registered: both, what it took, and what is left. */
export function Registered({ result, job }: { result: api.Outputs<'register'>; job: api.Job }) {
    const given: any = result.inputs ?? job.inputs ?? {};
    const [fixed, moving] = [idOf(given.template), idOf(given.moving)];
    const rows: [string, string][] = [
        [t`Distance`, t`${figure(result.distance, 4)} (before: ${figure(result.distanceBefore, 4)})`],
        [t`Areas are scaled by`, t`${figure(result.minJacobian)} to ${figure(result.maxJacobian)}`],
        [t`Steps`, t`${result.iterations}, ended by ${api.words(result.stopped).toLowerCase()}`],
        [t`Cut off by the degree`, figure(result.truncationError)],
        [t`How it was searched`, result.note],
    ];
    const over = useMemo(() => (fixed.startsWith('surf-') ? surfacePath(fixed, 32) : undefined), [fixed]);
    return (
        <>
            <dl class="pairs">{rows.map(([name, text]) => <><dt>{name}</dt><dd>{text}</dd></>)}</dl>
            <div class="split">
                <div>
                    <h2>{t`Registered${over ? t`, over the template` : ''}`}</h2>
                    <Shape src={surfacePath(result.surface.id, 32)} label={t`The registered surface`} name="registered" over={over} />
                    {over && <p class="quiet">{t`Blue: the template.`}</p>}
                    <div class="actions no-report"><a class="button" href={link('shapes', result.surface.id)}>{t`Open, download`}</a></div>
                </div>
                {!over && fixed && <div><h2>{t`Template`}</h2><Linked id={fixed} title={t`as it was given`} /></div>}
                {moving && <div><h2>{t`Moving`}</h2><Linked id={moving} title={t`as it was given`} /></div>}
            </div>
            <LandmarkResult found={result.landmarks} given={given.landmarks} ends={['template', 'moving']} ids={[fixed, moving]} />
        </>
    );
}

/** A path between two shapes. */
export function Between({ result, job }: { result: api.Outputs<'geodesic'>; job: api.Job }) {
    const given: any = result.inputs ?? job.inputs ?? {};
    return (
        <>
            <p class="big">{t`Distance ${figure(result.distance, 4)}`} <span class="quiet">{t`length of the path ${figure(result.length, 4)}`}</span></p>
            <Path surfaces={result.surfaces} texts={result.times.map((at) => `t = ${figure(at)}`)} energies={(result.relativeEnergies as any).geodesic} />
            <LandmarkResult found={result.landmarks} given={given.landmarks} ends={['from', 'to']} ids={[idOf(given.from), idOf(given.to)]} />
        </>
    );
}
