// A picture as its kernels read it: the host's view, what the device computes from it, and the transfer function.

const uint TABLE = 1024u; // entries of the transfer function

struct Frame {
    ViewUniforms view;
    DrawUniforms plan;
    FLOATS table[TABLE]; // sRGB colour, and opacity of one step
};
