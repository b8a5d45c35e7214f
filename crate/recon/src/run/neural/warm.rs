//! Every kernel of the network used once, so that it is compiled before the pictures come, and while the weights still do.

use super::levels::{parents_of, read};
use super::network::{Input, Network, rows};
use crate::plan::NetworkConfig;
use burn::{
    Tensor,
    tensor::{DType, Device},
};
use glam::{Affine3A, IVec3, Vec3};
use mesh::camera::Pinhole;
use net::{Ipdrecon, Level, View, decode::children, guide::Guidance, model::Decoded};
use volume::VolumeError;

/// Coarse voxels along an edge of what is looked at.
const EDGE: i32 = 4;

/// Compiles the kernels of a network of this shape on a device: one without training works on a few voxels before two blank
/// pictures. On the processor there is nothing to compile, and nothing is done.
///
/// # Errors
/// A device that fails.
pub async fn warm_up_network(config: &NetworkConfig, device: &Device) -> Result<(), VolumeError> {
    if *device == Device::flex() {
        return Ok(());
    }
    let network = Ipdrecon::new(&config.net, device);
    let (width, height) = config.size;
    let camera = Pinhole {
        width,
        height,
        fx: width as f32,
        fy: width as f32,
        cx: width as f32 / 2.0,
        cy: height as f32 / 2.0,
    };
    let view = |x| View {
        camera,
        world_from_camera: Affine3A::from_translation(Vec3::new(x, 0.0, 0.0)),
    };
    let views = [view(-0.1), view(0.1)];
    let planes = views.map(|view| {
        let blank = Tensor::zeros(
            [1, 3, height as usize, width as usize],
            (device, DType::F32),
        );
        Network::planes(&network, blank, &[view])
    });
    let origin_m = Vec3::new(0.0, 0.0, 1.0);
    let block = (0..EDGE * EDGE * EDGE).map(|i| {
        let [x, y, z] = [i % EDGE, i / EDGE % EDGE, i / EDGE / EDGE];
        IVec3::new(x - EDGE / 2, y - EDGE / 2, z)
    });
    let mut sites: Vec<IVec3> = block.collect();
    let mut above: Option<Decoded> = None;
    for level in Level::ALL {
        let parts = [&planes[0][level as usize], &planes[1][level as usize]];
        let plane = network.stack(&parts);
        let (fused, seen) = Network::fuse(&network, level, &plane, &views, &sites, origin_m);
        let says = vec![Guidance::default(); sites.len()];
        let input = Input {
            sites: &sites,
            origin_m,
            fused,
            above: above
                .as_ref()
                .map(|above| (above, rows(parents_of(sites.len()), device))),
            guide: network
                .guided()
                .then(|| super::guide::tensor(&says, device)),
        };
        let decoded = Network::decode(&network, level, input);
        // Only what is read is sure to have run.
        read(decoded.logit.clone()).await?;
        if let Some(confidence) = seen.and_then(|seen| seen.confidence) {
            read(confidence).await?;
        }
        above = Some(decoded);
        sites = children(&sites);
    }
    Ok(())
}
