// Shapes at points of a model, as the service computes them while one waits; nothing of it is stored.
import * as api from './api';
import { t } from './i18n';

export interface Point { positions: Float32Array; offset: number; energy: number }

export const RESOLUTION = 24;
/** Degree up to which the service computes shapes while one waits. */
export const LIVE_MAX = 31;
const FILE_RESOLUTION = 48;

/** Where a file of that shape is had. */
export const shapeFile = (model: string, coefficients: number[], format: string): string =>
    `/v1/models/${model}/shape?coefficients=${coefficients.join(',') || 0}&format=${format}&resolution=${FILE_RESOLUTION}`;

/** Of a model of several structures, the shape of one of them. */
export async function shapeOf(model: string, coefficients: number[], signal?: AbortSignal, part?: string): Promise<Point> {
    const of = part === undefined ? '' : `&part=${encodeURIComponent(part)}`;
    const response = await api.request(`/v1/models/${model}/shape?coefficients=${coefficients.join(',')}${of}&format=positions&resolution=${RESOLUTION}`, { signal });
    const number = (name: string) => Number(response.headers.get(name));
    return { positions: new Float32Array(await response.arrayBuffer()), offset: number('Srnfd-Offset'), energy: number('Srnfd-Relative-Energy') };
}

export const existence = (offset: number): string =>
    offset < 0.1 ? t`this shape exists` : offset <= 0.5 ? t`the shape shown is the nearest that exists, ${Math.round(100 * offset)} % of the way off`
        : t`such a shape does not exist; this is the nearest one`;
