// Arrays of numbers as textures of texels in rows.
import { ClampToEdgeWrapping, DataTexture, FloatType, HalfFloatType, LinearFilter, LinearMipmapLinearFilter,
    MirroredRepeatWrapping, NearestFilter, RedFormat, RedIntegerFormat, RepeatWrapping, RGBAFormat, SRGBColorSpace,
    Texture, UnsignedByteType, UnsignedIntType, type Wrapping } from "three";
import type { MeshImage } from "./glb.ts";
import { paletteBytes } from "./palettes.ts";
import type { Palette } from "../state/state.ts";

const WIDTH = 2048;

export function rowsFor(count: number): { width: number; height: number } {
    const width = Math.min(WIDTH, Math.max(1, count));
    return { width, height: Math.max(1, Math.ceil(count / width)) };
}

/** Half precision, as bits; write() is one upload. */
export class HalfTexture {
    readonly texture: DataTexture;
    private readonly room: Uint16Array<ArrayBuffer>;

    constructor(readonly count: number) {
        const { width, height } = rowsFor(count);
        this.room = new Uint16Array(width * height);
        this.texture = new DataTexture(this.room, width, height, RedFormat, HalfFloatType);
        this.texture.unpackAlignment = 1;
        this.texture.needsUpdate = true;
    }

    write(bits: Uint16Array): void {
        this.room.set(bits);
        this.texture.needsUpdate = true;
    }

    dispose(): void {
        this.texture.dispose();
    }
}

export function integerTexture(values: Uint32Array): DataTexture {
    const { width, height } = rowsFor(values.length);
    const room = new Uint32Array(width * height);
    room.set(values);
    const texture = new DataTexture(room, width, height, RedIntegerFormat, UnsignedIntType);
    texture.internalFormat = "R32UI";
    texture.minFilter = texture.magFilter = NearestFilter;
    texture.needsUpdate = true;
    return texture;
}

/** One byte per element, 0 or 255. */
export function maskTexture(count: number, isSet: (i: number) => boolean): DataTexture {
    const { width, height } = rowsFor(count);
    const room = new Uint8Array(width * height);
    for (let i = 0; i < count; i++) room[i] = isSet(i) ? 255 : 0;
    const texture = new DataTexture(room, width, height, RedFormat, UnsignedByteType);
    texture.unpackAlignment = 1;
    texture.needsUpdate = true;
    return texture;
}

export function paletteTexture(name: Palette): DataTexture {
    const texture = new DataTexture(paletteBytes(name), 256, 1, RGBAFormat, UnsignedByteType);
    texture.minFilter = texture.magFilter = LinearFilter;
    texture.wrapS = ClampToEdgeWrapping;
    texture.needsUpdate = true;
    return texture;
}

/** Numbers in single precision, as rows of texels. */
export function floatTexture(values: Float32Array): DataTexture {
    const { width, height } = rowsFor(values.length);
    const room = new Float32Array(width * height);
    room.set(values);
    const texture = new DataTexture(room, width, height, RedFormat, FloatType);
    texture.needsUpdate = true;
    return texture;
}

/** A texel of 1: no image. */
export function whiteTexture(): DataTexture {
    const texture = new DataTexture(new Uint8Array([255, 255, 255, 255]), 1, 1, RGBAFormat, UnsignedByteType);
    texture.needsUpdate = true;
    return texture;
}

const WRAPS: { [gltf: number]: Wrapping } = { 33648: MirroredRepeatWrapping, 33071: ClampToEdgeWrapping };

/** An image of the mesh; its pixels are decoded to linear light where they are read. */
export async function imageTexture(image: MeshImage, anisotropy: number): Promise<Texture> {
    const bitmap = await createImageBitmap(new Blob([image.jpeg], { type: "image/jpeg" }), {
        colorSpaceConversion: "none",
    });
    const texture = new Texture(bitmap);
    texture.flipY = false;
    texture.colorSpace = SRGBColorSpace;
    [texture.wrapS, texture.wrapT] = image.wrap.map((wrap) => WRAPS[wrap] ?? RepeatWrapping);
    texture.minFilter = LinearMipmapLinearFilter;
    texture.anisotropy = anisotropy;
    texture.needsUpdate = true;
    return texture;
}

/** A texel of 0 where a texture is not there yet. */
export function emptyTexture(): DataTexture {
    const texture = new DataTexture(new Float32Array(1), 1, 1, RedFormat, FloatType);
    texture.needsUpdate = true;
    return texture;
}
