// Names of meshes and surfaces by their ids.
import * as api from './api';

export async function namesOf(ids: string[]): Promise<Map<string, string>> {
    const names = new Map<string, string>();
    const wanted = new Set(ids);
    for (const kind of ['meshes', 'surfaces'] as const) {
        if (![...wanted].some((id) => id.startsWith(kind.slice(0, 4)) && !names.has(id))) continue;
        await api.listAll(kind, (items) => {
            for (const item of items) if (wanted.has(item.id)) names.set(item.id, item.name || item.id);
        }, () => [...wanted].every((id) => names.has(id) || !id.startsWith(kind.slice(0, 4))));
    }
    return names;
}
