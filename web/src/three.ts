// What is used of three, so that its chunk changes with its version only.
export {
    AmbientLight, BufferAttribute, BufferGeometry, Color, DirectionalLight, DoubleSide, Group, Matrix3, Matrix4, Mesh, MeshLambertMaterial,
    OrthographicCamera, Plane, Points, PointsMaterial, Quaternion, Scene, SRGBColorSpace, Vector3, WebGLRenderer,
} from 'three';
