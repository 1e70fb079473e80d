//! Collision events of entities, as a game engine dispatches them: entities with their own ids, boxes
//! as minimum and maximum, begin and end events per frame, and a ray that picks an entity.

use std::collections::HashMap;

use throng::{Box3, BroadPhase, Error, Filter, ObjectId};

/// An entity id of the engine.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
struct Entity(u64);

/// The engine's own box, as in Bevy (`Aabb3d`) and Rapier (`Aabb`).
#[derive(Clone, Copy)]
struct Aabb {
    min: [f32; 3],
    max: [f32; 3],
}

#[derive(Debug, PartialEq)]
enum CollisionEvent {
    Started(Entity, Entity),
    Stopped(Entity, Entity),
}

// snippet-begin: plugin
#[derive(Default)]
struct Names {
    entity_of: HashMap<ObjectId, Entity>,
    object_of: HashMap<Entity, ObjectId>,
}

struct Collisions {
    objects: BroadPhase,
    names: Names,
}

impl Collisions {
    fn spawn(&mut self, entity: Entity, aabb: Aabb, filter: Filter) -> Result<(), Error> {
        let object = self.objects.add_one(Box3::new(aabb.min, aabb.max), filter)?;
        self.names.entity_of.insert(object, entity);
        self.names.object_of.insert(entity, object);
        Ok(())
    }

    /// The id keeps its name until another entity gets it: `step` reports the pairs that end.
    fn despawn(&mut self, entity: Entity) -> Result<(), Error> {
        self.objects.remove(&[self.names.object_of[&entity]])?;
        self.names.object_of.remove(&entity);
        Ok(())
    }

    /// Moves entities, and returns the events of this frame.
    fn step(&mut self, moved: &[(Entity, Aabb)]) -> Result<Vec<CollisionEvent>, Error> {
        let (ids, boxes): (Vec<ObjectId>, Vec<Box3>) = moved
            .iter()
            .map(|(entity, aabb)| (self.names.object_of[entity], Box3::new(aabb.min, aabb.max)))
            .unzip();
        self.objects.move_objects(&ids, &boxes)?;
        let changes = self.objects.update()?;
        let name = |object| self.names.entity_of[&object];
        let begun = changes.begun.iter();
        let ended = changes.ended.iter();
        Ok(begun
            .map(|p| CollisionEvent::Started(name(p.first), name(p.second)))
            .chain(ended.map(|p| CollisionEvent::Stopped(name(p.first), name(p.second))))
            .collect())
    }

    /// The first entity that the ray hits, and the distance.
    fn cast_ray(
        &mut self,
        origin: [f32; 3],
        direction: [f32; 3],
        length: f64,
    ) -> Result<Option<(Entity, f64)>, Error> {
        let hit = self.objects.raycast(origin, direction, length, u32::MAX)?;
        Ok(hit.map(|hit| (self.names.entity_of[&hit.object], hit.distance)))
    }
}
// snippet-end: plugin

/// A cube of size 1 around a point on the x axis.
fn cube_at(x: f32) -> Aabb {
    Aabb { min: [x - 0.5, 0.0, -0.5], max: [x + 0.5, 1.0, 0.5] }
}

fn main() -> Result<(), Error> {
    let (ground, wall, ball) = (Entity(7001), Entity(7002), Entity(42));
    let mut collisions = Collisions { objects: BroadPhase::new()?, names: Names::default() };
    let fixed = Filter { is_static: true, ..Filter::default() };
    let floor = Aabb { min: [-50.0, -1.0, -50.0], max: [50.0, 0.0, 50.0] };
    collisions.spawn(ground, floor, fixed)?;
    collisions.spawn(wall, cube_at(3.0), fixed)?; // static: no pair with the ground
    collisions.spawn(ball, cube_at(0.0), Filter::default())?;

    for frame in 0..6 {
        if frame == 5 {
            collisions.despawn(ball)?;
        }
        let position = frame as f32;
        let moved = if frame < 5 { vec![(ball, cube_at(position))] } else { vec![] };
        for event in collisions.step(&moved)? {
            println!("frame {frame}: {event:?}");
        }
    }
    if let Some((entity, distance)) =
        collisions.cast_ray([0.0, 0.5, 0.0], [1.0, 0.0, 0.0], 100.0)?
    {
        println!("the ray hits {entity:?} at a distance of {distance}");
    }
    Ok(())
}
