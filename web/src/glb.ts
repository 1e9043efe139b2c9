// GLB as the service writes it: one mesh, 32-bit floats and indices, fields as attributes _NAME.
import { t } from './i18n';

export interface Field { name: string; unit?: string; meaning?: string; values: Float32Array; low: number; high: number }
export interface Surface3 { positions: Float32Array; normals: Float32Array; indices: Uint32Array; fields: Field[] }

const MAGIC = 0x46546c67;

export function readGlb(buffer: ArrayBuffer): Surface3 {
    const head = new DataView(buffer);
    if (buffer.byteLength < 28 || head.getUint32(0, true) !== MAGIC) throw new Error(t`The shape did not come as GLB.`);
    const jsonLength = head.getUint32(12, true);
    const json = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 20, jsonLength)));
    const start = 20 + jsonLength + 8;
    const view = (index: number, width: number) => {
        const accessor = json.accessors[index];
        const offset = start + (json.bufferViews[accessor.bufferView].byteOffset ?? 0) + (accessor.byteOffset ?? 0);
        return { offset, length: accessor.count * width };
    };
    const floats = (index: number, width: number) => {
        const { offset, length } = view(index, width);
        return new Float32Array(buffer, offset, length);
    };
    const mesh = json.meshes[0];
    const part = mesh.primitives[0];
    const about = mesh.extras?.fields ?? {};
    const fields = Object.keys(part.attributes).filter((name) => name.startsWith('_')).map((name) => {
        const values = floats(part.attributes[name], 1);
        let low = Infinity;
        let high = -Infinity;
        for (const v of values) {
            if (v < low) low = v;
            if (v > high) high = v;
        }
        return { name: about[name]?.name ?? name.slice(1).toLowerCase(), unit: about[name]?.unit, meaning: about[name]?.meaning, values, low, high };
    });
    const { offset, length } = view(part.indices, 1);
    return {
        positions: floats(part.attributes.POSITION, 3), normals: floats(part.attributes.NORMAL, 3),
        indices: new Uint32Array(buffer, offset, length), fields,
    };
}
